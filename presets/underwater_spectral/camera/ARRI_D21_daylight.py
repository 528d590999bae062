"""ARRI D21 daylight."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "ARRI D21"
water.white_balance = "daylight"
water.tone = "standard"
