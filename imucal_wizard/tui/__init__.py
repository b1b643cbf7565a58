"""The terminal app: it shows the decisions of the domain and passes on the operator's commands."""
