"""The paper, claim by claim: each sentence that a program can test, with its verdict."""
