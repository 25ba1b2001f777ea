"""Tests that click: a package, so that its browser is gone before the tests after it."""
