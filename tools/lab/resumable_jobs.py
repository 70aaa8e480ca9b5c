"""The commands that go on where they were, as jobs of a second or less, for kill_matrix.py and tamper_matrix.py."""
import hashlib
import json
import math
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

SCENE = """<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="32"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0, 0, 8" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/><rfilter type="box"/></film>
  </sensor>
  <emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>
  <shape type="ply"><string name="filename" value="egg.ply"/>
    <bsdf type="roughdielectric"><float name="alpha" value="0.2"/></bsdf>
    <include filename="skin.xml"/>
  </shape>
</scene>
"""
FLOOR = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0, -3, 3" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/><rfilter type="box"/></film>
  </sensor>
  <emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>
  <shape type="rectangle">
    <bsdf type="diffuse" id="wood"><texture type="bitmap" name="reflectance"><string name="filename" value="wood.ppm"/></texture></bsdf>
  </shape>
</scene>
"""
MEDIUM = """<scene version="3.0.0">
  <medium type="homogeneous" name="interior" id="skin">
    <float name="sigma_t" value="10"/><rgb name="albedo" value="0.9, 0.8, 0.7"/><phase type="hg"><float name="g" value="0.5"/></phase>
  </medium>
</scene>
"""


def egg(rings=10, sectors=16):
    """A closed mesh as the text of a PLY file."""
    ring = lambda i, j: 1 + (i - 1) * sectors + j % sectors
    points = [(0, 0, -1.5)]
    for i in range(1, rings):
        polar = math.pi * i / rings
        points += [(math.sin(polar) * math.cos(2 * math.pi * j / sectors), math.sin(polar) * math.sin(2 * math.pi * j / sectors),
                    -1.5 * math.cos(polar)) for j in range(sectors)]
    points.append((0, 0, 1.5))
    faces = []
    for j in range(sectors):
        faces += [(0, ring(1, j + 1), ring(1, j)), (len(points) - 1, ring(rings - 1, j), ring(rings - 1, j + 1))]
        for i in range(1, rings - 1):
            faces += [(ring(i, j), ring(i, j + 1), ring(i + 1, j + 1)), (ring(i, j), ring(i + 1, j + 1), ring(i + 1, j))]
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *[f"property float {c}" for c in "xyz"],
            f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(head + ["%.7g %.7g %.7g" % p for p in points] + ["3 %d %d %d" % f for f in faces]) + "\n"


class Job:
    """A command, which folder it writes, and which files it reads. All names are relative to the folder that it runs in.
    half_way: a file of the output that is there when the command is on its way."""

    def __init__(self, name, arguments, output, half_way, inputs):
        self.name, self.arguments, self.output, self.half_way, self.inputs = name, arguments, output, half_way, inputs

    def start(self, itn, work):
        return subprocess.Popen([str(itn), *self.arguments, "-o", self.output, "--quiet"], cwd=work, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE)

    def run(self, itn, work):
        process = self.start(itn, work)
        error = process.communicate()[1].decode(errors="replace")
        return process.returncode, error

    def contents(self, work):
        """What must not depend on interruptions, by file: checksums. Times may differ, and reports show them."""
        return contents(work / self.output)


def without_times(value):
    if isinstance(value, dict):
        return {key: without_times(of) for key, of in value.items() if key != "time"}
    return [without_times(of) for of in value] if isinstance(value, list) else value


def contents(folder):
    found = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        data = path.read_bytes()
        if path.name == "report.html":
            data = b""
        elif path.name == "result.json":
            data = json.dumps(without_times(json.loads(data))).encode()
        found[str(path.relative_to(folder))] = hashlib.sha256(data).hexdigest()
    return found


def write_inputs(itn, work):
    """The files that the jobs read, all but what jobs themselves make for others."""
    (work / "scene.xml").write_text(SCENE)
    (work / "skin.xml").write_text(MEDIUM)
    (work / "floor.xml").write_text(FLOOR)
    (work / "wood.ppm").write_bytes(b"P6 2 2 255\n" + bytes(range(40, 160, 10)))
    for name in ("egg", "pea"):
        (work / f"{name}.ply").write_text(egg())
    side = {"shapes": ["egg.ply"], "azimuths": [0, 60], "materials": 10}
    (work / "config.json").write_text(json.dumps({"preset": "tiny", "size": 16, "spp": 8, "train": side,
                                                  "test": {"shapes": ["pea.ply"], "azimuths": [30], "materials": 3}}))
    sky = (ROOT / "scenes/test/uniform.exr").read_bytes()
    (work / "sky.exr").write_bytes(sky)
    for scene, name, spp in (("scene", "target", "256"), ("scene", "mask", "4"), ("floor", "floor", "64")):
        subprocess.run([str(itn), "render", f"{scene}.xml", "--spp", spp, "-o", f"{name}.exr", "--quiet"], cwd=work, check=True)


def jobs():
    """In the order in which they need each other's results: `set` and `run` are outputs of the first two."""
    invert = ["invert", "scene.xml", "--target", "target.exr", "--mask", "mask.exr", "--parameter", "skin.sigma_t"]
    files = ["scene.xml", "skin.xml", "egg.ply", "sky.exr", "target.exr", "mask.exr"]
    start = ["--start", "skin.sigma_t=5"]
    return [
        Job("dataset", ["dataset", "config.json"], "set", "images/000012.exr", ["config.json", "egg.ply", "pea.ply"]),
        Job("train", ["train", "set", "--network", "rn", "--width", "2", "--epochs", "8", "--batch", "4", "--channels", "6", "--threads", "1",
                      "--checkpoint-every", "0"], "run", "checkpoint.safetensors",
            ["set/manifest.json", "set/images/000003.exr", "set/shapes/egg.exr"]),
        Job("gauss-newton", invert + start + ["--spp", "16"], "gauss-newton", "state.json", files),
        Job("adam", invert + start + ["--spp", "8", "--method", "adam", "--iterations", "12"], "adam", "state.json", files),
        Job("textures", ["invert", "floor.xml", "--target", "floor.exr", "--parameter", "wood.reflectance", "--method", "adam", "--iterations",
                         "8", "--spp", "4", "--repeats", "2"], "textures", "state-0.bin", ["floor.xml", "wood.ppm", "sky.exr", "floor.exr"]),
        Job("posterior", invert + ["--spp", "16", "--method", "posterior", "--iterations", "2"], "posterior", "renderings/000004_0.exr",
            files),
        Job("eval", ["eval", "set", "run", "--images", "2", "--inversions", "1", "--iterations", "4", "--threads", "1"], "report",
            "inversions_truth.json",
            ["set/manifest.json", "set/images/000020.exr", "set/shapes/pea.ply", "run/network.safetensors"]),
    ]


def run_whole(job, itn, work):
    """Runs a job to its end; what it has written."""
    code, error = job.run(itn, work)
    if code not in (0, 1):  # 1: an inversion that has not converged
        sys.exit(f"{job.name}: exit code {code}: {error}")
    return job.contents(work)
