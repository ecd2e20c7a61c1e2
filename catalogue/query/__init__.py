"""From a wish to ranked, verified candidates."""
