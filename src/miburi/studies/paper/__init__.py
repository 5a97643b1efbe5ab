"""The paper, claim by claim: each sentence that a program can carry out, with its verdict."""
