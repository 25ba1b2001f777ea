"""Motor controllers by mjbots."""
