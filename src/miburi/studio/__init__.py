"""What people see and touch: the live partner's pages, and its interface for programs."""
