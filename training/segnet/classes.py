"""The classes of the shipped network: index 0 is background, then the order below. COCO's category ids."""

NAMES = ("person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "bird", "cat", "dog", "horse",
         "sheep", "cow", "elephant", "bear", "zebra", "giraffe", "chair", "book", "cup")
MOVERS = 19                       # so many of the first names move by themselves; the others only when moved


def of_dataset(coco):
    """(names, category ids) in the network's order: ours when the data has them all, else the data's own."""
    by_name = {c["name"]: c["id"] for c in coco["categories"]}
    names = list(NAMES) if all(n in by_name for n in NAMES) else [c["name"] for c in coco["categories"]]
    return names, [by_name[n] for n in names]
