"""Constraints: what projects positions after integration."""
