"""One more lamp compiles no material anew: nodes are the same, their numbers are others."""

from __future__ import annotations

import pytest
from underwater_spectral.node_groups import lamp_images, realtime_lamps
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

COMPONENTS = parse_phase("mixture").for_bands([0.3], [0.01]).components


def _structure(tree):
    """What a shader is made of, but for numbers: nodes, links, and the groups in it."""
    places = {node.name: place for place, node in enumerate(tree.nodes)}
    return (
        [
            (node.bl_idname, getattr(node, "operation", ""), _structure(node.node_tree))
            if node.bl_idname == "ShaderNodeGroup"
            else (node.bl_idname, getattr(node, "operation", ""))
            for node in tree.nodes
        ],
        sorted(
            (
                places[link.from_node.name],
                link.from_socket.identifier,
                places[link.to_node.name],
                link.to_socket.identifier,
            )
            for link in tree.links
        ),
    )


@pytest.mark.slow_but_first
@pytest.mark.parametrize("others", [(2, 1, 1), (9, 3, 6), (14, 8, 6)])
def test_nodes_do_not_depend_on_how_many_lamps_there_are(others):
    def made(lamps, profiles, virtual):
        images = lamp_images.new_images(
            lamps, profiles, lamp_images.LampRows.of_parts(len(COMPONENTS)), virtual=virtual
        )
        patch = realtime_lamps.build_patch(images, ("Seen",), facets=2)
        path = realtime_lamps.build_path(images, COMPONENTS, ahead=False)
        return _structure(patch), _structure(path)

    one = made(7, 2, 6)
    assert len(one[0][0]) > 10
    assert made(*others) == one
    # Objects that throw nothing back need fewer.
    assert made(1, 1, 0) != one
