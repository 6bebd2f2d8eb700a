"""Joint values for poses by gradients of the pose, in PyTorch; run with the package on the path."""

import torch
import ur5.torch

torch.manual_seed(1)
limit = torch.tensor(2.0, dtype=torch.float64)


def error(q: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """Squared error of each pose, lengths in m beside entries of the rotation."""
    return ((ur5.torch.fk(q) - target) ** 2).sum((-2, -1))


# A thousand targets that the arm reaches, and a start near each: a robot that moved while nobody looked.
true = (torch.rand(1000, 6, dtype=torch.float64) - 0.5) * 2 * limit
target = ur5.torch.fk(true)
q = (true + 0.2 * torch.randn_like(true)).requires_grad_()

# Adam comes near: the gradient of the pose is that of the kernel of the Jacobian.
optimiser = torch.optim.Adam([q], lr=0.02)
print("poses closer than 0.01 before:", int((error(q, target) < 1e-4).sum()), "of", len(q))
for _ in range(200):
    optimiser.zero_grad()
    error(q, target).sum().backward()
    optimiser.step()
print("poses closer than 0.01:", int((error(q, target) < 1e-4).sum()), "of", len(q))

# Newton's steps finish: second derivatives are those of the kernel of the Hessian.
slopes, curvatures = torch.func.grad(error), torch.func.hessian(error)
found = q.detach()
for _ in range(5):
    steps = torch.linalg.lstsq(
        torch.func.vmap(curvatures)(found, target), torch.func.vmap(slopes)(found, target)
    ).solution
    found = found - steps
print("poses closer than 1e-9:", int((error(found, target) < 1e-18).sum()), "of", len(q))
