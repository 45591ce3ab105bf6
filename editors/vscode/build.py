"""Build the extension: `python editors/vscode/build.py [FOLDER]` writes `visup-VERSION.vsix`."""

from __future__ import annotations

import json
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
GRAMMAR = HERE.parents[1] / "tasks" / "tools" / "tasks.tmLanguage.json"
FILES = (
    "package.json",
    "extension.js",
    "client.js",
    "language-configuration.json",
    "README.md",
    "syntaxes/rules.tmLanguage.json",
)
CONTENT_TYPES = """<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="json" ContentType="application/json"/>
<Default Extension="js" ContentType="application/javascript"/>
<Default Extension="md" ContentType="text/markdown"/>
<Default Extension="vsixmanifest" ContentType="text/xml"/>
</Types>
"""
MANIFEST = """<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011">
<Metadata>
<Identity Language="en-US" Id="{name}" Version="{version}" Publisher="{publisher}"/>
<DisplayName>{displayName}</DisplayName>
<Description xml:space="preserve">{description}</Description>
<Categories>Programming Languages</Categories>
<Properties><Property Id="Microsoft.VisualStudio.Code.Engine" Value="{engine}"/></Properties>
</Metadata>
<Installation><InstallationTarget Id="Microsoft.VisualStudio.Code"/></Installation>
<Dependencies/>
<Assets>
<Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true"/>
</Assets>
</PackageManifest>
"""


def build(folder: Path = HERE) -> Path:
    """Write the extension.

    Args:
        folder: Where to.

    Returns:
        The `.vsix` file; the same sources give the same bytes.
    """
    package = json.loads((HERE / "package.json").read_text(encoding="utf-8"))
    target = folder / f"{package['name']}-{package['version']}.vsix"
    manifest = MANIFEST.format(**package, engine=package["engines"]["vscode"])
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        _put(archive, "[Content_Types].xml", CONTENT_TYPES)
        _put(archive, "extension.vsixmanifest", manifest)
        for name in FILES:
            _put(archive, f"extension/{name}", (HERE / name).read_text(encoding="utf-8"))
        grammar = json.loads(GRAMMAR.read_text(encoding="utf-8"))
        grammar["scopeName"] = "source.visup-task"
        _put(archive, "extension/syntaxes/tasks.tmLanguage.json", json.dumps(grammar, indent=1))
    return target


def _put(archive: zipfile.ZipFile, name: str, text: str) -> None:
    """One file, dated so that the same sources give the same bytes."""
    archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), text)


if __name__ == "__main__":
    print(build(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE))
