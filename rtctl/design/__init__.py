"""Designs on models: responses, margins, controllers, mechanics, tables."""
