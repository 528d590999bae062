"""Renders: planned into a manifest, worked pass by pass, developed; on one machine or a farm."""
