"""The recipe of conda can be read, says the version of the program, and has requirements on every system:

    pip install py-rattler-build==0.73.0 && python .ci/conda/check.py
"""

import re
from pathlib import Path

from rattler_build import PlatformConfig, RenderConfig, Stage0Recipe, VariantConfig

ROOT = Path(__file__).resolve().parents[2]


def main():
    recipe = Stage0Recipe.from_file(ROOT / ".ci/conda/recipe.yaml")
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M).group(1)
    assert recipe.context["version"] == version, f"{recipe.context} is not of version {version}"
    variants = VariantConfig({"c_compiler": ["gcc"], "c_stdlib": ["sysroot"], "rust_compiler": ["rust"], "python": ["3.11", "3.12"]})
    for platform in ["linux-64", "linux-aarch64", "osx-arm64", "osx-64", "win-64"]:
        rendered = recipe.render(variants, RenderConfig(platform=PlatformConfig(target_platform=platform, build_platform="linux-64", host_platform=platform)))
        assert rendered, platform
        print(f"{platform}: {len(rendered)} packages")


main()
