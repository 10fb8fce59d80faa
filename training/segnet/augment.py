"""Augmentation for a hand-held camera among people: bodies of any size, cut anywhere, rolled, blurred, dark, compressed."""
import cv2
import numpy as np


def affine(scale, degrees, mirrored, source, target):
    """2x3 matrix that takes the point `source` to `target`, scaled and rotated (and mirrored left-right first)."""
    a = np.deg2rad(degrees)
    m = scale * np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    if mirrored:
        m = m @ np.diag([-1.0, 1.0])
    t = np.asarray(target, float) - m @ np.asarray(source, float)
    return np.hstack([m, t[:, None]])


def random_affine(rng, size, canvas, persons, full, plain):
    """size, canvas, full: (h, w). persons: boxes x0 y0 x1 y1 of the image.

    full: what the image would be fitted into; the canvas may be a part of that. plain: little is changed.
    """
    h, w = size
    H, W = canvas
    fit = min(full[0] / h, full[1] / w)
    roll = rng.normal(0, 1) if plain else rng.uniform(-45, 45) if rng.random() < 0.1 else rng.normal(0, 4)
    mirrored = rng.random() < 0.5
    if len(persons) and not plain and rng.random() < 0.35:
        # Near bodies: headless, legs only, an arm at the border. The body is up to twice as tall as the picture.
        x0, y0, x1, y1 = persons[rng.integers(len(persons))]
        extent = max(y1 - y0, x1 - x0, 20.0)
        scale = np.exp(rng.uniform(np.log(0.3), np.log(1.8))) * full[0] / extent
        scale = min(scale, fit * 3.0)                      # more would only show blur
        source = (rng.uniform(x0, x1), rng.uniform(y0, y1))
        target = (rng.uniform(0.2, 0.8) * W, rng.uniform(0.2, 0.8) * H)
        return affine(scale, roll, mirrored, source, target)
    scale = fit * np.exp(rng.uniform(np.log(0.8), np.log(1.2)) if plain else rng.uniform(np.log(0.75), np.log(1.6)))
    if len(persons) and canvas != full and rng.random() < 0.7:
        x0, y0, x1, y1 = persons[rng.integers(len(persons))]
        return affine(scale, roll, mirrored, (rng.uniform(x0, x1), rng.uniform(y0, y1)), (rng.uniform(0.1, 0.9) * W, rng.uniform(0.1, 0.9) * H))
    # Slide so that picture and canvas overlap as far as the scale allows.
    spare_x, spare_y = W - scale * w, H - scale * h
    cx = W / 2 + rng.uniform(-0.5, 0.5) * abs(spare_x)
    cy = H / 2 + rng.uniform(-0.5, 0.5) * abs(spare_y)
    return affine(scale, roll, mirrored, (w / 2, h / 2), (cx, cy))


def clear_affine(rng, size, canvas, boxes, full):
    """Like random_affine, but so that the canvas shows a part of the image without any of the `boxes`; None if ten tries find none."""
    h, w = size
    H, W = canvas
    fit = min(full[0] / h, full[1] / w)
    for _ in range(10):
        scale = fit * np.exp(rng.uniform(0, np.log(3.0)))
        # The part lies within the image where it can.
        spare_x, spare_y = max(0.0, w - W / scale) / 2, max(0.0, h - H / scale) / 2
        source = (w / 2 + rng.uniform(-spare_x, spare_x), h / 2 + rng.uniform(-spare_y, spare_y))
        m = affine(scale, rng.normal(0, 4), rng.random() < 0.5, source, (W / 2, H / 2))
        corners = np.array([[[x0, y0], [x1, y0], [x0, y1], [x1, y1]] for x0, y0, x1, y1 in boxes]) @ m[:, :2].T + m[:, 2]
        low, high = corners.min(1), corners.max(1)
        if not ((low < (W, H)).all(1) & (high > 0).all(1)).any():
            return m
    return None


def motion_blur(rng, img):
    n = int(rng.integers(3, 20)) | 1
    k = np.zeros((n, n), np.float32)
    a = rng.uniform(0, np.pi)
    c, d = n // 2, np.array([np.cos(a), np.sin(a)]) * (n // 2)
    cv2.line(k, (int(round(c - d[0])), int(round(c - d[1]))), (int(round(c + d[0])), int(round(c + d[1]))), 1.0)
    return cv2.filter2D(img, -1, k / k.sum())


def photometric(rng, img):
    """img: uint8 RGB; returns uint8."""
    if rng.random() < 0.8:
        gain = np.exp(rng.normal(0, 0.18, 3) * rng.choice([0.3, 1.0])) * np.exp(rng.normal(0, 0.2))
        bias, gamma = rng.normal(0, 12), np.exp(rng.normal(0, 0.2))
        ramp = np.linspace(0, 1, 256)[:, None] ** gamma * 255 * gain[None] + bias
        img = cv2.LUT(img, np.clip(ramp, 0, 255).astype(np.uint8)[None])
    if rng.random() < 0.3:
        grey = cv2.cvtColor(cv2.cvtColor(img, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
        s = rng.uniform(0.0, 1.6)
        img = cv2.addWeighted(img, s, grey, 1 - s, 0)
    if rng.random() < 0.12:
        img = motion_blur(rng, img)
    elif rng.random() < 0.1:
        img = cv2.GaussianBlur(img, (0, 0), rng.uniform(0.6, 2.0))
    dark = rng.random() < 0.1
    if dark or rng.random() < 0.12:
        f = rng.uniform(0.15, 0.5) if dark else 1.0
        noise = np.empty(img.shape, np.int16)
        cv2.randn(noise, (0, 0, 0), (rng.uniform(2, 9),) * 3)
        img = np.clip(img.astype(np.int16) * f + noise, 0, 255).astype(np.uint8)
    if rng.random() < 0.15:
        ok, buf = cv2.imencode(".jpg", img[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(20, 75))])
        img = cv2.imdecode(buf, cv2.IMREAD_COLOR)[:, :, ::-1]
    return np.ascontiguousarray(img)


def paste(rng, canvas, masks, cut, polygons):
    """Draws the body or thing `polygons` of the picture `cut` somewhere onto the canvas; what it hides is cut from `masks`.

    Returns the new mask or None. Some bodies are cut off by a straight edge, as by a table or a door frame.
    """
    H, W = canvas.shape[:2]
    points = np.concatenate(polygons)
    x0, y0 = points.min(0)
    x1, y1 = points.max(0)
    if y1 - y0 < 50 or x1 - x0 < 20:
        return None
    scale = min(np.exp(rng.uniform(np.log(0.3), np.log(1.4))) * H / max(y1 - y0, x1 - x0), 3.5)
    m = affine(scale, rng.normal(0, 6), rng.random() < 0.5, ((x0 + x1) / 2, (y0 + y1) / 2), (rng.uniform(0, W), rng.uniform(0.1, 1.1) * H))
    body = np.zeros((H, W), np.uint8)
    for p in polygons:
        cv2.fillPoly(body, [np.round((p @ m[:, :2].T + m[:, 2]) * 16).astype(np.int32)], 1, cv2.LINE_8, 4)
    if rng.random() < 0.35:
        ys, xs = np.nonzero(body)
        if len(ys) < 100:
            return None
        cut_at = int(rng.uniform(ys.min(), ys.max()))
        if rng.random() < 0.6:
            body[:cut_at] = 0
        else:
            body[cut_at:] = 0
    if body.sum() < 400:
        return None
    bx, by, bw, bh = cv2.boundingRect(body)
    m2 = m.copy()
    m2[:, 2] -= (bx, by)
    picture = cv2.warpAffine(cut, m2, (bw, bh), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    alpha = cv2.GaussianBlur(body[by:by + bh, bx:bx + bw].astype(np.float32), (0, 0), rng.uniform(0.5, 1.5))[..., None]
    alpha *= body[by:by + bh, bx:bx + bw, None] * 0.5 + 0.5
    region = canvas[by:by + bh, bx:bx + bw]
    region[:] = (region * (1 - alpha) + picture * alpha).astype(np.uint8)
    for other in masks:
        other[body > 0] = 0
    return body
