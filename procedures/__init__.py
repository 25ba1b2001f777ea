"""One measurement each, step by step as in the document; the estimators beneath them."""
