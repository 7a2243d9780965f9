"""The pages people read: words for what was found, and self-contained HTML."""
