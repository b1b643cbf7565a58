"""The built-in effects. Every module here defines one class; nothing else lists them."""
