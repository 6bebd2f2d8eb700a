"""Programs for arms that run in controllers themselves."""
