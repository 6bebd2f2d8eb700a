"""The pages that `kinegen show` prints, one module per notation: a `Sheet` in, text out."""
