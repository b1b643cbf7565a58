"""The terminal app: it shows what the domain decided and passes on what the operator wants."""
