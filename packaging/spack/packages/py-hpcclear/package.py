# Rendered by packaging/render.py: words between at signs come from the source distribution and pyproject.toml.
from spack.package import *


class PyHpcclear(PythonPackage):
    """MPI-parallel robust design of mechanisms with clearance joints."""

    pypi = "hpcclear/hpcclear-@VERSION@.tar.gz"
    license("BSD-3-Clause")

    version("@VERSION@", sha256="@SHA256@")

    depends_on("python@3.11:", type=("build", "run"))
    depends_on("mpi")
    @BUILD@
    @RUN@
