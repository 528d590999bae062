"""Nikon D7000 daylight."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "Nikon D7000"
water.white_balance = "daylight"
water.tone = "nikon-d7000"
