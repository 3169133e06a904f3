"""Each format is read back by the package that it is for, or by a plain reader of it. (command)"""

import shutil
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.place_graph import Connection
from placegraph.tools.export import dsg, svg
from placegraph.tools.map_files.map_folder import read_cloud, read_object_clouds
from placegraph.tools.map_files.ply import write_points
from placegraph.tools.rooms import read_map

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def graph(mapped):
    return SceneGraph.load(mapped / "graph.json")


def test_spark_dsg_loads_every_node_box_name_and_edge(cli, mapped, graph, tmp_path):
    spark_dsg = pytest.importorskip("spark_dsg", reason="`make test` installs it")
    out = tmp_path / "dsg.json"
    assert cli("export", mapped, "dsg", "--out", out).code == 0
    found = spark_dsg.DynamicSceneGraph.load(str(out))
    joined = {one.rooms for one in graph.connections.values()}
    assert found.num_nodes() == len(graph.nodes) and found.num_edges() == len(graph.nodes) - 1 + len(joined)
    for a, b in joined:
        assert found.has_edge(dsg.symbol(a), dsg.symbol(b))
    for node in graph.nodes.values():
        there = found.get_node(dsg.symbol(node.id))
        assert there.id.str(False) == f"{node.id[0]}({node.id[1:]})" and there.layer.layer == dsg.LAYERS[node.layer]
        assert there.attributes.name == node.name
        np.testing.assert_allclose(there.attributes.position, node.center, atol=1e-3)
        if node.parent:
            assert found.has_edge(dsg.symbol(node.parent), there.id.value)
    names = found.get_labelspace(dsg.LAYERS["object"], 0).labels_to_names
    for thing in graph.layer("object"):
        there = found.get_node(dsg.symbol(thing.id)).attributes
        assert names[there.semantic_label] == thing.name
        np.testing.assert_allclose(there.bounding_box.dimensions, thing.oriented_box[3:6], atol=2e-3)
        x, y = there.bounding_box.world_R_center[:2, 0]
        assert np.arctan2(y, x) == pytest.approx(thing.oriented_box[6], abs=2e-3)


def test_the_plan_draws_every_place_and_object_where_it_is(cli, mapped, graph, tmp_path):
    out = tmp_path / "plan.svg"
    assert cli("export", mapped, "svg", "--out", out).code == 0
    root = ElementTree.parse(out).getroot()
    drawn = {shape.find(f"{SVG}title").text.split()[0]: shape for shape in root.iter(f"{SVG}polygon")}
    assert set(drawn) == {node.id for node in graph.nodes.values() if node.layer in ("room", "location", "object")}
    groups = root.findall(f"{SVG}g")
    assert len(groups) == len(graph.layer("floor"))
    width, height = (float(v) for v in root.get("viewBox").split()[2:])
    for group in groups:
        x, y = (float(v) for v in group.get("transform").split("(")[1].split(")")[0].split())
        for shape in group.findall(f"{SVG}polygon"):
            points = np.array([pair.split(",") for pair in shape.get("points").split()], float)
            on_sheet = np.array([x, y]) + points * [1, -1]
            assert (on_sheet >= 0).all() and (on_sheet <= [width, height]).all()


def test_the_plan_marks_doors_on_their_floor_and_stairs_on_both():
    def node(id, parent, z=0.0):
        box = np.array([[0, 0, z], [4, 4, z + 2.6]])
        return GraphNode(id=id, parent=parent, tags=(), box=box, footprint=box[:, :2], first_frame=0, last_frame=0)

    nodes = [
        node("B0", ""),
        node("F0", "B0"),
        node("F1", "B0", 3),
        node("R0", "F0"),
        node("R1", "F0"),
        node("R2", "F1", 3),
    ]
    kept = {"width_m": 0.9, "length_m": 5.0}
    door = Connection(id="C0", kind="door", rooms=("R0", "R1"), ends=np.array([[2.0, 1, 0]] * 2), **kept)
    stairs = Connection(id="C1", kind="stairs", rooms=("R0", "R2"), ends=np.array([[1.0, 1, 0], [3, 1, 3]]), **kept)
    root = ElementTree.fromstring(svg.drawing(SceneGraph.of(nodes, [door, stairs])))
    lower, upper = root.findall(f"{SVG}g")
    (disc,) = root.iter(f"{SVG}circle")
    assert (disc.get("cx"), disc.get("cy"), disc.get("r")) == ("2.000", "1.000", "0.450") and disc in list(lower)
    lines = [floor.findall(f"{SVG}line") for floor in (lower, upper)]
    assert [[line.get("x1") for line in found] for found in lines] == [["1.000"], ["1.000"]]


def test_ros_maps_have_walls_and_free_rooms_in_the_world_frame(cli, mapped, graph, tmp_path):
    out = tmp_path / "ros"
    assert cli("export", mapped, "ros", "--out", out).code == 0
    floors = graph.layer("floor")
    assert sorted(path.name for path in out.iterdir()) == sorted(
        f"{floor.id}.{suffix}" for floor in floors for suffix in ("pgm", "yaml")
    )
    plan = read_map(out / f"{floors[0].id}.yaml")
    assert plan.occupied.any() and plan.free.any() and not (plan.occupied & plan.free).any()
    room = max(graph.layer("room"), key=lambda node: float(np.prod(node.box[1] - node.box[0])))
    rows, columns = np.nonzero(plan.free[::-1])
    free = np.array(plan.origin) + (np.stack((columns, rows), 1) + 0.5) * plan.resolution
    inside = ((free > room.box[0, :2]) & (free < room.box[1, :2])).all(axis=1)
    assert inside.mean() > 0.9
    again = cli("export", mapped, "ros", "--out", out)
    assert again.code == 2 and "not an empty folder" in again.err


def test_a_glb_holds_the_cloud_named_boxes_of_objects_and_fences_of_places(cli, mapped, graph, tmp_path):
    trimesh = pytest.importorskip("trimesh", reason="extra `export`")
    out = tmp_path / "map.glb"
    assert cli("export", mapped, "glb", "--out", out).code == 0
    scene = trimesh.load(out)
    xyz, _ = read_cloud(mapped)
    cloud = scene.geometry["cloud"]
    assert len(cloud.vertices) == len(xyz)
    shown = [node for node in graph.nodes.values() if node.layer in ("room", "location", "object")]
    assert {f"{node.id} {node.name}" for node in shown} == set(scene.geometry) - {"cloud"}
    room = graph.layer("room")[0]
    name = f"{room.id} {room.name}"
    placed, _ = scene.graph.get(name)
    fence = np.asarray(scene.geometry[name].vertices) @ placed[:3, :3].T + placed[:3, 3]
    wanted = np.array([room.box[0, 0], room.box[0, 2], -room.box[1, 1]])  # x, z, -y: glTF's up is y
    np.testing.assert_allclose(fence.min(axis=0), wanted, atol=1e-3)
    placed, _ = scene.graph.get("cloud")
    world = np.asarray(cloud.vertices) @ placed[:3, :3].T + placed[:3, 3]
    np.testing.assert_allclose(world[:, 1], xyz[:, 2], atol=1e-4)  # glTF's up is y


def test_each_node_has_its_points_as_ply_in_place(cli, mapped, graph, tmp_path):
    trimesh = pytest.importorskip("trimesh", reason="extra `export`")
    out = tmp_path / "ply"
    assert cli("export", mapped, "ply", "--out", out).code == 0
    clouds = {path.stem: trimesh.load(path) for path in out.iterdir()}
    nodes = {node.id: node for node in graph.nodes.values() if node.layer != "building"}
    assert set(clouds) == set(nodes)
    xyz, _ = read_cloud(mapped)
    assert sum(len(clouds[floor.id].vertices) for floor in graph.layer("floor")) == len(xyz)
    points = read_object_clouds(mapped)
    for node_id, node in nodes.items():
        found = np.asarray(clouds[node_id].vertices)
        if node.layer == "object":
            np.testing.assert_array_equal(found, points[node_id])
            assert clouds[node_id].colors[0, :3].tolist() == list(node.color)
        elif node.layer == "location":
            assert len(found) == sum(len(points[thing.id]) for thing in graph.descendants(node_id, "object"))
        elif node.layer == "room":
            assert (found[:, :2] >= node.box[0, :2] - 0.1).all() and (found[:, :2] <= node.box[1, :2] + 0.1).all()
            assert len(found) > 100
    again = cli("export", mapped, "ply", "--out", out)
    assert again.code == 2 and "not an empty folder" in again.err


def test_points_of_another_run_are_noticed(cli, mapped, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(mapped, other, ignore=shutil.ignore_patterns("*.rrd"))
    write_points(other / "objects.ply", np.zeros((0, 3)), {"object": np.zeros(0, np.int32)})
    done = cli("export", other, "ply", "--out", tmp_path / "ply")
    assert done.code == 1 and "no points of O" in done.err and not (tmp_path / "ply").exists()


def test_equal_maps_give_equal_bytes_and_wrong_input_is_named(cli, mapped, tmp_path):
    for kind in ("dsg", "svg"):
        for name in ("one", "two"):
            assert cli("export", mapped, kind, "--out", tmp_path / name).code == 0
        assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    absent = cli("export", tmp_path / "nowhere", "svg", "--out", tmp_path / "a.svg")
    assert absent.code == 1 and "nowhere" in absent.err
    blocked = cli("export", mapped, "svg", "--out", tmp_path / "no" / "folder" / "a.svg")
    assert blocked.code == 2 and "cannot write there" in blocked.err
    (tmp_path / "bare").mkdir()
    (tmp_path / "bare" / "graph.json").write_text((mapped / "graph.json").read_text())
    (tmp_path / "bare" / "cloud.ply").write_bytes((mapped / "cloud.ply").read_bytes()[:-1])
    cut = cli("export", tmp_path / "bare", "ros", "--out", tmp_path / "c")
    assert cut.code == 1 and "cut short" in cut.err
