"""Gives exported trunks one output more: what the backbone makes at a fine stride, for the refinement of masks."""
import os
from xml.etree import ElementTree

import onnx


def narrowest_at(path, stride):
    """Name and channels of the narrowest tensor at that stride, the last of several: what a backbone's stage hands on."""
    graph = onnx.shape_inference.infer_shapes(onnx.load(path)).graph
    side = lambda t: [d.dim_value for d in t.type.tensor_type.shape.dim]
    h, w = side(graph.input[0])[2:]
    fitting = [(t.name, side(t)[1]) for t in graph.value_info if len(side(t)) == 4 and side(t)[2:] == [h // stride, w // stride]]
    least = min(c for _, c in fitting)
    return [(n, c) for n, c in fitting if c == least][-1]


def add(folder, int8, stride):
    """The narrowest tensor at that stride becomes the trunk's output `fine`, channels last, in the trunk of eight bits (its file's
    name, or None) as well; trunks that have it stay as they are. Returns its channels."""
    path = os.path.join(folder, "trunk.onnx")
    name, channels = narrowest_at(path, stride)
    m = onnx.load(path)
    if all(o.name != "fine" for o in m.graph.output):
        h, w = (d.dim_value // stride for d in m.graph.input[0].type.tensor_type.shape.dim[2:])
        m.graph.node.append(onnx.helper.make_node("Transpose", [name], ["fine"], name="/fine", perm=[0, 2, 3, 1]))
        m.graph.output.append(onnx.helper.make_tensor_value_info("fine", onnx.TensorProto.FLOAT, [1, h, w, channels]))
        onnx.checker.check_model(m)
        onnx.save(m, path)
    if int8:
        add_int8(os.path.join(folder, int8), name)
    return channels


def add_int8(path, name):
    """Edits the text of OpenVINO's graph, whose own writer would number every layer anew: versions then differ by all their lines."""
    with open(path) as f:
        text = f.read()
    root = ElementTree.fromstring(text)
    layers, edges = {int(e.get("id")): e for e in root.find("layers")}, root.find("edges")
    if any(e.get("names") == "fine" for e in root.iter("port")):
        return
    into = lambda layer, port: next(e for e in edges if (int(e.get("to-layer")), int(e.get("to-port"))) == (layer, port))
    # Its transpositions to channels last all take their order from a constant; any of them will do.
    order = next(into(i, 1) for i, e in layers.items() if e.get("type") == "Transpose")
    source = next(i for i, e in layers.items() if any(name in (p.get("names") or "").split(",") for p in e.iter("port")))
    readers = [int(e.get("to-layer")) for e in edges if int(e.get("from-layer")) == source]
    if len(readers) == 1 and layers[readers[0]].get("type") == "FakeQuantize":
        source = readers[0]                                # as the next layer sees it: before, the sum would be kept as floats as well
    out = layers[source].find("output/port")
    n, c, h, w = (d.text for d in out.findall("dim"))
    port = lambda k, dims, names="": (f'<port id="{k}" precision="{"I64" if len(dims) == 1 else "FP32"}"{names}>' +
                                      "".join(f"<dim>{d}</dim>" for d in dims) + "</port>")
    turned, result = max(layers) + 1, max(layers) + 2
    text = text.replace("</layers>", f"""<layer id="{turned}" name="/fine" type="Transpose" version="opset1">
<input>{port(0, (n, c, h, w))}{port(1, (4,))}</input>
<output>{port(2, (n, h, w, c), ' names="fine"')}</output>
</layer>
<layer id="{result}" name="fine/sink_port_0" type="Result" version="opset1" output_names="fine">
<input>{port(0, (n, h, w, c))}</input>
</layer>
</layers>""")
    edge = lambda a, k, b, q: f'<edge from-layer="{a}" from-port="{k}" to-layer="{b}" to-port="{q}" />\n'
    text = text.replace("</edges>", edge(source, out.get("id"), turned, 0) + edge(order.get("from-layer"), order.get("from-port"), turned, 1) +
                        edge(turned, 2, result, 0) + "</edges>")
    with open(path, "w") as f:
        f.write(text)
