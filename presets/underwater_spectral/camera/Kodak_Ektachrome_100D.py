"""Kodak Ektachrome 100D."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "Kodak Ektachrome 100D"
water.white_balance = "daylight"
water.tone = "standard"
