"""Parts of screens as rows of text: pure functions of the content and of the size."""
