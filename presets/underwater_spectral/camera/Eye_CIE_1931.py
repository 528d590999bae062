"""Eye CIE 1931."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "cie1931"
water.white_balance = "daylight"
water.tone = "standard"
