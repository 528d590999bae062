"""ARRI D21 balanced at depth."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "ARRI D21"
water.white_balance = "depth"
water.tone = "standard"
