"""Random edits of a user's while there is water: no error, nothing left, nothing else changed."""

from __future__ import annotations

import random

import bpy
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene import marks
from underwater_spectral.scene.materials import wet_trees
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.viewport import live, live_scenes
from underwater_spectral.scene.water import giving_back, scene_water
from underwater_spectral.tests.scene import snapshot
from underwater_spectral.tests.scene.test_live_survives import add, furnish, left_overs

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
NUMBER, NAME = "fuzz", "fuzz name"
KINDS = (
    "objects", "collections", "meshes", "materials", "lights", "cameras", "worlds", "images",
    "node_groups", "scenes",
)  # fmt: skip


class User:
    """Edits a file at random, and remembers what was touched, by the number it carries."""

    def __init__(self, seed: int, water) -> None:
        self.random, (self.add, self.remove) = random.Random(seed), water
        self.touched: set[int] = set()
        self.edits = 0
        for number, block in enumerate(blocks()):
            block[NUMBER], block[NAME] = number, block.name

    def edit(self) -> str:
        """Do one thing of those below."""
        name = self.random.choice(EDITS)
        known = {block.session_uid for block in blocks()}
        getattr(self, name)()
        for block in blocks():
            if block.session_uid not in known and name not in BACK:
                block.pop(NUMBER, None)  # a copy
        if name not in BACK:
            bpy.ops.ed.undo_push(message=name)
        self.edits += 1
        return name

    def touch(self, *found):
        users = bpy.data.user_map()
        for block in found:
            for one in (block, *users[block]):
                self.touched.add(one.get(NUMBER, -1))
                if isinstance(one, bpy.types.Mesh):  # objects show the materials of theirs
                    self.touched |= {item.get(NUMBER, -1) for item in users[one]}

    def any(self, *kinds):
        found = [block for kind in kinds for block in getattr(bpy.data, kind)]
        return self.random.choice(found) if found else None

    def tree(self):
        materials = [m for m in bpy.data.materials if len(m.node_tree.nodes)]
        material = self.random.choice(materials) if materials else None
        if material is not None:
            self.touch(material, *(n.node_tree for n in material.node_tree.nodes if is_group(n)))
        return None if material is None else material.node_tree

    def rename(self):
        block = self.any(*KINDS)
        block.name = f"{self.random.choice(('UW ', ''))}name {self.random.randrange(99)}"

    def rename_node(self):
        tree = self.tree()
        if tree is not None:
            self.random.choice(tree.nodes).name = f"node {self.random.randrange(99)}"

    def delete_node(self):
        tree = self.tree()
        if tree is not None:
            tree.nodes.remove(self.random.choice(tree.nodes))

    def cut_link(self):
        tree = self.tree()
        if tree is not None and len(tree.links):
            tree.links.remove(self.random.choice(tree.links))

    def mute(self):
        tree = self.tree()
        if tree is not None and len(tree.links):
            link = self.random.choice(tree.links)
            link.is_muted = not link.is_muted
            node = self.random.choice(tree.nodes)
            node.mute = not node.mute

    def wire(self):
        """A new shader at the output, or one mixed in before it."""
        tree = self.tree()
        output = None if tree is None else tree.get_output_node("EEVEE")
        if output is None:
            return
        surface = output.inputs["Surface"]
        made = tree.nodes.new(self.random.choice(("ShaderNodeMixShader", "ShaderNodeEmission")))
        if surface.is_linked and made.bl_idname == "ShaderNodeMixShader":
            tree.links.new(surface.links[0].from_socket, made.inputs[1])
        tree.links.new(made.outputs[0], surface)

    def wire_anything(self):
        tree = self.tree()
        if tree is None:
            return
        one, other = (self.random.choice(tree.nodes) for _ in range(2))
        if one != other and one.outputs and other.inputs:
            tree.links.new(self.random.choice(one.outputs), self.random.choice(other.inputs))

    def colour(self):
        tree = self.tree()
        for node in tree.nodes if tree is not None else ():
            if "Base Color" in node.inputs:
                node.inputs["Base Color"].default_value = (self.random.random(), 0.2, 0.1, 1.0)

    def delete(self):
        block = self.any(*KINDS)
        if isinstance(block, bpy.types.Scene) and len(bpy.data.scenes) == 1:
            return
        self.touch(block)
        if isinstance(block, bpy.types.Scene):
            self.touch(*(item for item in block.objects))
        if MARK in block:  # links that lead through groups go with them
            self.touch(*bpy.data.materials, *bpy.data.node_groups)
        if isinstance(block, bpy.types.Scene):
            bpy.data.scenes.remove(block)  # windows let go of it; in a batch they would not
        else:
            bpy.data.batch_remove([block])

    def copy(self):
        block = self.any("objects", "meshes", "materials", "lights", "worlds", "node_groups")
        if block is None:
            return
        made = block.copy()
        if isinstance(made, bpy.types.Object):
            bpy.context.scene.collection.objects.link(made)
            self.touch(bpy.context.scene)

    def single(self):
        item = self.any("objects")
        if item is not None and item.data is not None:
            self.touch(item, item.data)
            item.data = item.data.copy()

    def swap(self):
        item, material = self.any("objects"), self.any("materials")
        if item is not None and item.type == "MESH" and material is not None:
            self.touch(item, item.data, material)
            if item.material_slots:
                self.touch(*(s.material for s in item.material_slots if s.material))
                item.material_slots[0].link = self.random.choice(("DATA", "OBJECT"))
                item.material_slots[0].material = self.random.choice((material, None))
            else:
                item.data.materials.append(material)

    def hide(self):
        item = self.any("objects")
        if item is not None:
            self.touch(item)
            item.hide_render = not item.hide_render
            item.hide_viewport = self.random.choice((True, False))

    def parent(self):
        one, other = self.any("objects"), self.any("objects")
        if one is not None and one != other:
            self.touch(one, other)
            one.parent = None if other.parent else other

    def world(self):
        scene = self.any("scenes")
        self.touch(scene, *bpy.data.worlds)
        scene.world = self.random.choice((None, *bpy.data.worlds))

    def unlink(self):
        scene = self.any("scenes")
        inner, items = list(scene.collection.children), list(scene.collection.objects)
        self.touch(scene, *inner, *items)
        if inner and self.random.random() < 0.5:
            scene.collection.children.unlink(self.random.choice(inner))
        elif items:
            scene.collection.objects.unlink(self.random.choice(items))

    def scene(self):
        if len(bpy.data.scenes) < 4:
            kind = self.random.choice(("NEW", "EMPTY", "LINK_COPY", "FULL_COPY"))
            self.touch(bpy.context.scene)
            bpy.ops.scene.new(type=kind)

    def purge(self):
        self.touch(*(block for block in blocks() if not block.users))
        bpy.ops.outliner.orphans_purge(do_recursive=True)
        self.touched |= set(range(999)) - {block.get(NUMBER) for block in blocks()}

    def undo(self):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()

    def redo(self):
        if bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()

    def look(self):
        bpy.context.view_layer.update()
        wet_trees.refresh()

    def again(self):
        """Remove the water, and add it again."""
        scene = bpy.context.scene
        self.remove(scene)
        self.add(scene)


EDITS = [name for name in vars(User) if not name.startswith("_")]
EDITS = [name for name in EDITS if name not in {"edit", "touch", "any", "tree"}]
BACK = {"undo", "redo"}


def is_group(node):
    return node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None


def blocks():
    return [block for kind in KINDS for block in getattr(bpy.data, kind)]


def dump():
    """Every value of each block that carries a number, under that number and its own name."""
    found = {}
    for block in [b for b in blocks() if NUMBER in b]:
        block.name = block[NAME]
    for block in [b for b in blocks() if NUMBER in b]:
        one = snapshot._Snapshot()
        one.walk("", block, 0)
        found[block[NUMBER]] = one.result
    return found


def of_blender(line):
    """Values that Blender finds out only once it draws, or counts by itself."""
    known = (
        ".enabled",
        ".is_icon_visible",
        ".is_inactive",
        ".is_unavailable",
        ".users",
        ".name",
        ".matrix_",
    )
    return any(x in line.split(":")[0] for x in known)


def check(before, user):
    """What the user has not touched is as it was before the water."""
    after, found = dump(), []
    for number in before.keys() - user.touched:
        if number not in after:
            found.append(f"{before[number]['.name']} is gone")
        else:
            lines = snapshot.differences(before[number], after[number])
            found += [f"{before[number]['.name']}{x}" for x in lines if not of_blender(x)]
    assert found == [], found[:6]


FRAME, LIVE = (add, scene_water.remove), (live.add, live_scenes.take_out)
"""What touches the user's objects, in milliseconds; and all of live water."""


def try_round(seed, edits, path=None, water=FRAME):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.preferences.edit.use_global_undo = True
    scene = furnish()
    scene.frame_set(1)
    chosen = scene.underwater
    chosen.phase, chosen.bands, chosen.diffuse_shadows = "hg:0.924", 4, False
    if water is LIVE:  # the light around a lamp takes as long as everything else
        bpy.data.objects.remove(bpy.data.objects["POINT"])
    user = User(seed, water)
    before, done = dump(), []
    bpy.ops.ed.undo_push(message="start")
    user.add(bpy.context.scene)
    bpy.ops.ed.undo_push(message="water")
    try:
        for number in range(edits):
            done.append(user.edit())
            if path is not None and number == edits // 2:
                bpy.ops.wm.save_as_mainfile(filepath=str(path))
                bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
                user.touched |= before.keys() - {block.get(NUMBER) for block in blocks()}
        for scene in list(bpy.data.scenes):
            user.remove(scene)
        giving_back.let_go()
        assert left_overs() == []
        check(before, user)
    except Exception as error:
        raise AssertionError(f"seed {seed}: {done}") from error
    return user.edits, len(before.keys() - user.touched)


@pytest.mark.parametrize(
    ("rounds", "edits"), [(6, 25), pytest.param(150, 30, marks=pytest.mark.slow)]
)
def test_random_edits_leave_nothing_and_change_nothing_else(
    registered, rounds, edits, tmp_path, record_property
):
    done = untouched = 0
    for seed in range(rounds):
        path = tmp_path / "file.blend" if seed % 4 == 3 else None
        tried, compared = try_round(seed, edits, path)
        done, untouched = done + tried, untouched + compared
    assert untouched > rounds
    record_property("edits", done)
    record_property("blocks compared", untouched)
    assert marks.waters() == {}


@pytest.mark.slow
def test_random_edits_of_live_water_raise_nothing(registered, tmp_path, capfd):
    """Handlers and updates in between: what goes wrong there is printed, and said in the panel."""
    for seed in range(1000, 1020):
        path = tmp_path / "file.blend" if seed % 4 == 3 else None
        try_round(seed, 20, path, LIVE)
        assert not any(is_live(scene) for scene in bpy.data.scenes)
        assert "Traceback" not in capfd.readouterr().err
