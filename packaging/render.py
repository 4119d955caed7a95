"""Recipes with the version, the checksum and the dependencies of a source distribution.

python packaging/render.py DIST     writes DIST/packaging, and checks that the Spack package can be read and names all
"""

import hashlib
import re
import runpy
import shutil
import sys
import tarfile
import tomllib
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).resolve().parent


def conda(requirement: str) -> str:
    """`numpy>=2.0` as conda writes it."""
    name, bounds = parts(requirement)
    return f"- {name} {bounds}".rstrip()


def spack(requirement: str, kind: str) -> str:
    """`numpy>=2.0` as Spack writes it; of its bounds the lowest, which are the ones that this package has."""
    name, bounds = parts(requirement)
    lowest = re.search(r">=([\d.]+)", bounds)
    return f'depends_on("py-{name.lower()}{f"@{lowest[1]}:" if lowest else ""}", type={kind})'


def parts(requirement: str) -> tuple[str, str]:
    """Name and bounds of a requirement without extras."""
    found = re.fullmatch(r"([A-Za-z0-9_.-]+)\s*(.*)", requirement)
    if found is None:
        raise SystemExit(f"{requirement}: no name and bounds")
    return found[1], found[2]


def rendered(text: str, words: dict[str, str | list[str]]) -> str:
    """Words of the text between at signs by their values; a list takes a line each, indented as the word is."""
    for word, value in words.items():
        if isinstance(value, str):
            text = text.replace(f"@{word}@", value)
            continue
        line = re.compile(rf"^( *)(?:- )?@{word}@$", re.M)
        text = line.sub(lambda found, lines=value: "\n".join(found[1] + one for one in lines), text)
    if left := re.search(r"@[A-Z]+\d*@", text):
        raise SystemExit(f"{left[0]} is left in a recipe")
    return text


def main(dist: Path) -> None:
    source = next(dist.glob("hpcclear-*.tar.gz"))
    version = source.name.removeprefix("hpcclear-").removesuffix(".tar.gz")
    with tarfile.open(source) as archive:
        member = archive.extractfile(f"hpcclear-{version}/pyproject.toml")
        assert member is not None
        project = tomllib.loads(member.read().decode())
    build, run = project["build-system"]["requires"], project["project"]["dependencies"]
    fixed = {"VERSION": version, "SHA256": hashlib.sha256(source.read_bytes()).hexdigest()}
    place = dist / "packaging"
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(
        HERE, place, ignore=shutil.ignore_patterns("render.py", "README.md", "__pycache__")
    )
    lists: dict[str, dict[str, str | list[str]]] = {
        "conda-forge/recipe.yaml": {"BUILD": [*map(conda, build)], "RUN": [*map(conda, run)]},
        "spack/packages/py-hpcclear/package.py.in": {
            "BUILD": [spack(one, '"build"') for one in build],
            "RUN": [spack(one, '("build", "run")') for one in run],
        },
    }
    for name, words in lists.items():
        path = place / name
        text = rendered(path.read_text(encoding="utf-8"), fixed | words)
        path.unlink()
        path.with_name(path.name.removesuffix(".in")).write_text(text, encoding="utf-8")
        print(path)
    read = spack_package(place / "spack/packages/py-hpcclear/package.py")
    wanted = {f"py-{parts(one)[0].lower()}" for one in build + run} | {"mpi", "python"}
    if read != ({version}, wanted):
        raise SystemExit(f"the Spack package says {read}, not version {version} with {wanted}")
    print(f"the Spack package depends on {len(wanted)} others, as pyproject.toml")


def spack_package(path: Path) -> tuple[set[str], set[str]]:
    """Versions and names of dependencies that a Spack package declares, read as Spack reads it."""
    versions: set[str] = set()
    names: set[str] = set()

    def version(number: str, *, sha256: str) -> None:
        assert re.fullmatch(r"[0-9a-f]{64}", sha256)
        versions.add(number)

    def depends_on(spec: str, type: str | tuple[str, ...] = ("build", "link")) -> None:
        assert ({type} if isinstance(type, str) else set(type)) <= {"build", "link", "run"}
        names.add(spec.partition("@")[0])

    module = ModuleType("spack.package")
    words = {"PythonPackage": type("PythonPackage", (), {}), "license": lambda name: None}
    vars(module).update(words, version=version, depends_on=depends_on)
    sys.modules |= {"spack": ModuleType("spack"), "spack.package": module}
    runpy.run_path(str(path))
    return versions, names


if __name__ == "__main__":
    main(Path(sys.argv[1]))
