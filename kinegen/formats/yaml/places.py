"""Where nodes are in the text of a robot file, for commands that edit it in place."""

from __future__ import annotations

import yaml


def end_of(node: yaml.Node) -> int:
    """Where the text of a node ends; a block ends with its last entry, not with the comments below it."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return end_of(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)
