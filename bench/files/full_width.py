"""Full-width forms of the printable signs of ASCII, as input methods for Chinese send them."""

#: The sign of ASCII of each, for `str.translate`.
PLAIN = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)}
