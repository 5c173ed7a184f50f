"""Links to the repository, once its address is known.

The address stands in one place, `[project.urls]` of pyproject.toml. Until it does, no page
links to a repository, and chapters have no buttons that launch them elsewhere. Once it does,
pages have both, and the directive `published` shows its content, with ADDRESS replaced. Thebe,
which Jupyter Book always adds, goes: it would need the network.
"""

from importlib import metadata

from sphinx.util.docutils import SphinxDirective

# Links that a reader may follow; nothing is asked of these servers before.
LAUNCHERS = {
    "binderhub_url": "https://mybinder.org",
    "colab_url": "https://colab.research.google.com",
    "notebook_interface": "jupyterlab",
}


def project_url():
    """Return where the sources are published, or nothing."""
    entries = metadata.metadata("armlock").get_all("Project-URL") or []
    return dict(entry.split(", ") for entry in entries).get("repository", "").rstrip("/")


class Published(SphinxDirective):
    """Show the content if the book has an address, and nothing otherwise."""

    has_content = True

    def run(self):
        """Return the content with the address in it."""
        address = project_url()
        if not address:
            return []
        return self.parse_text_to_nodes("\n".join(self.content).replace("ADDRESS", address))


def show_links(app, config):
    """Give the theme the address."""
    if address := project_url():
        config.html_theme_options |= {
            "repository_url": address,
            "use_repository_button": True,
            "launch_buttons": LAUNCHERS,
        }


def drop_thebe(app, pagename, templatename, context, doctree):
    """Take out the scripts of Thebe, which also declare their names twice."""
    scripts = context["script_files"]
    context["script_files"] = [one for one in scripts if "thebe" not in repr(vars(one)).lower()]


def setup(app):
    """Register with Sphinx."""
    app.connect("html-page-context", drop_thebe)
    app.add_directive("published", Published)
    app.connect("config-inited", show_links)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
