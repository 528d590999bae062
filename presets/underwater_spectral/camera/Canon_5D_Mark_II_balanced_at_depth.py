"""Canon 5D Mark II balanced at depth."""

import bpy

water = bpy.context.scene.underwater

water.sensor = "Canon EOS 5D Mark II"
water.white_balance = "depth"
water.tone = "canon-5d-mark-ii"
