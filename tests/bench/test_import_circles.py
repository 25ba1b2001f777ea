"""No file imports itself by way of others, imports for type checking included."""

from graphlib import TopologicalSorter

import grimp


def test_no_circle_between_files():
    graph = grimp.build_graph("bench", "drivers", "procedures", "reports", "sim_instruments", cache_dir=None)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert sum(len(modules) for modules in imported.values()) > 2000
    # Raises CycleError, which names the files.
    assert len(tuple(TopologicalSorter(imported).static_order())) == len(imported)
