"""The water that a user looks at while working: always there, always up to date."""
