"""Exported models in a browser: the three.js that trimesh ships loads them, and its animation follows our joints."""

from __future__ import annotations

import base64
import math
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

import sweep
from sweep.exchange.scene import over, shown_name
from sweep.families import NAMES
from tests.exchange.test_export import scaled
from tests.support.browser import DRAWS, launcher, opened, pixels

pytestmark = pytest.mark.browser
POSES = 36
LOAD = """(data) => new Promise((done, fail) => {
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    new THREE.GLTFLoader().parse(bytes.buffer, '', (gltf) => {
        window.model = gltf;
        window.mixer = new THREE.AnimationMixer(gltf.scene);
        gltf.animations.forEach((clip) => mixer.clipAction(clip).play());
        done(gltf.animations.map((clip) => clip.duration));
    }, fail);
})"""
AT = """(seconds) => {
    mixer.setTime(seconds);
    model.scene.updateMatrixWorld(true);
    const found = {};
    model.scene.traverse((node) => {
        found[node.name] = new THREE.Vector3().setFromMatrixPosition(node.matrixWorld).toArray();
    });
    return found;
}"""
SHOW = """() => {
    const box = new THREE.Box3().setFromObject(model.scene), centre = box.getCenter(new THREE.Vector3());
    const size = box.getSize(new THREE.Vector3()).length();
    const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(40, 1, 0.01 * size, 10 * size);
    scene.add(model.scene, new THREE.HemisphereLight(0xffffff, 0x8090a0, 2));
    camera.position.copy(centre).addScaledVector(new THREE.Vector3(0.5, 0.4, 1).normalize(), 1.5 * size);
    camera.lookAt(centre);
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.setSize(400, 400);
    renderer.setClearColor(0xffffff);
    document.body.replaceChildren(renderer.domElement);
    renderer.render(scene, camera);
}"""


@pytest.fixture(scope="module")
def viewer(tmp_path_factory):
    """A page with the libraries of trimesh's viewer, without what it would show."""
    packed = Path(trimesh.__file__).parent / "resources" / "templates" / "viewer.zip"
    page = zipfile.ZipFile(packed).read("viewer.html.template").decode()
    file = tmp_path_factory.mktemp("viewer") / "viewer.html"
    head, _ = page.rsplit("var camera,controls,scene", 1)
    file.write_text(f"{head}</script></body></html>")
    return file.as_uri()


@pytest.fixture(scope="module")
def browser():
    with launcher() as launch:
        found = launch(*DRAWS)
        yield found
        found.close()


@pytest.mark.parametrize("name", NAMES)
def test_model_opens_and_turns_as_the_joints_do(name, viewer, browser, tmp_path):
    file = sweep.export(name, scaled(name), tmp_path / "model.glb", poses=POSES, speed=math.pi)
    (part,) = over(name, scaled(name), 0.0, POSES)
    with opened(browser, viewer) as page:
        assert page.evaluate(LOAD, base64.b64encode(file.read_bytes()).decode()) == pytest.approx([2.0], abs=1e-6)
        for pose in (0, 7, 30):
            shown = page.evaluate(AT, 2.0 * pose / POSES)
            for joint, path in part.joints.items():
                x, y, z = path[pose]
                # metres, y upwards; float32 of 300 mm
                expected = [1e-3 * x, 1e-3 * z, -1e-3 * y]
                np.testing.assert_allclose(shown[shown_name(joint)], expected, atol=2e-7, err_msg=joint)
        page.evaluate(SHOW)
        assert (pixels(page.locator("canvas")).min(axis=2) < 0.9).mean() > 0.002
