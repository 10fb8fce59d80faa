"""Another backbone under a trained pyramid and heads."""
import torch

RIDGE = 1e-3            # of the features' mean square: keeps dead channels from large weights
RIDGE_OF_MEANS = 0.1    # the context has one sample a picture, fewer than unknowns


def backbone(net, path, batches):
    """Gives net the backbone of `path` (.npz) and fits the lateral convolutions to it by least squares over `batches`.

    Each lateral convolution, and that of the context, then gives nearly what it gave on the old backbone's features, so that all
    behind it goes on from what it has learnt. Returns the share of the variance that each fit explains.
    """
    pictures = [x.float() / 127.5 - 1 for x, _ in batches]
    net.eval()
    with torch.no_grad():
        before = [net.backbone(x) for x in pictures]
        net.backbone.load_folded(path)
        after = [net.backbone(x) for x in pictures]
        shares = []
        for level, lateral in enumerate(net.pyramid.lateral):
            shares.append(refit(lateral, [b[level] for b in before], [a[level] for a in after]))
        means = [[f[2].mean((2, 3), keepdim=True) for f in side] for side in (before, after)]
        shares.append(refit(net.pyramid.context, *means, RIDGE_OF_MEANS))
    return shares


def refit(conv, before, after, ridge=RIDGE):
    """A 1x1 convolution of `before`'s features fitted to `after`'s. Returns the share of the variance that it explains."""
    target = torch.cat([rows(conv(b)) for b in before])
    x = torch.cat([rows(a) for a in after])
    x = torch.cat((x, torch.ones(len(x), 1)), 1).double()
    gram = x.T @ x
    gram += torch.eye(len(gram)) * ridge * gram.diagonal()[:-1].mean()
    w = torch.linalg.solve(gram, x.T @ target.double())
    residual = target - (x @ w).float()
    conv.weight.copy_(w[:-1].T.float()[..., None, None])
    conv.bias.copy_(w[-1].float())
    return 1 - float(residual.var(0).sum() / target.var(0).sum())


def rows(features):
    return features.permute(0, 2, 3, 1).reshape(-1, features.shape[1])
