"""Find what must be there once and is there twice: a node's name, and the topics it publishes."""
# topics that many nodes publish on, by design
SHARED = ('/rosout', '/parameter_events', '/diagnostics')


def twins(node):
    """
    Return one sentence for each name of a node that another node has too.

    Parameters
    ----------
    node : rclpy.node.Node
        The node; what it publishes is compared with the graph as it knows it now.

    Returns
    -------
    list of str
        Empty when all names are its own.

    """
    name, space = node.get_name(), node.get_namespace()
    full = node.get_fully_qualified_name()
    if node.get_node_names_and_namespaces().count((name, space)) > 1:
        return [f'another node is named {full} too (or one that was killed still counts): its '
                'results mix with these; end one, or rename this with --ros-args -r __node:=NAME']
    return [f'{n} nodes publish {topic}: their messages mix; end one, or remap this with '
            f'--ros-args -r {topic}:=OTHER'
            for topic in sorted({p.topic_name for p in node.publishers} - set(SHARED))
            if (n := node.count_publishers(topic)) > 1]
