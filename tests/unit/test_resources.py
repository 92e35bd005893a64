"""Finding the templates."""

from __future__ import annotations

import jinja2
import pytest

from bfppc_synth.resources import (
    ResourceError,
    example_folder,
    template_environment,
    template_folder,
)


def test_the_working_tree_has_templates():
    names = template_environment().list_templates()
    assert "python/controller.py.jinja" in names
    assert "c/controller.c.jinja" in names


def test_a_wheel_has_them_inside_the_package(tmp_path):
    package = tmp_path / "site" / "bfppc_synth"
    (package / "templates").mkdir(parents=True)
    assert template_folder(package) == package / "templates"


def test_a_working_tree_has_them_beside_pyproject(tmp_path):
    package = tmp_path / "bfppc_synth"
    package.mkdir()
    (tmp_path / "templates").mkdir()
    with pytest.raises(ResourceError, match="install the package again"):
        template_folder(package)
    (tmp_path / "pyproject.toml").touch()
    assert template_folder(package) == tmp_path / "templates"


def test_the_examples_are_found_as_the_templates_are(tmp_path):
    assert (example_folder() / "van_der_pol.yaml").is_file()
    package = tmp_path / "bfppc_synth"
    package.mkdir()
    with pytest.raises(ResourceError, match="no plant file can begin"):
        example_folder(package)
    (package / "examples").mkdir()
    assert example_folder(package) == package / "examples"


def test_a_name_that_is_not_given_is_an_error():
    template = template_environment().from_string("{{ gain }}")
    with pytest.raises(jinja2.UndefinedError):
        template.render()


def test_only_html_is_escaped(tmp_path):
    environment = template_environment()
    loader = {"a.html.jinja": "{{ x }}", "a.c.jinja": "{{ x }}"}
    environment.loader = jinja2.DictLoader(loader)
    assert environment.get_template("a.html.jinja").render(x="a < b") == "a &lt; b"
    assert environment.get_template("a.c.jinja").render(x="a < b") == "a < b"
