"""The configs that come with rtctl, so that a wheel carries them."""
