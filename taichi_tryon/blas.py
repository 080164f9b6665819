"""The BLAS stays on one thread, whoever loaded it and whatever it was told.

How it divides a product among threads decides in what order the product's terms are added up, and so its last bits. Our
dense products are small: more threads would only fight Taichi's for the cores, at twice the cost.
"""

from threadpoolctl import threadpool_limits


def stay_on_one_thread() -> None:
    """Of this process, from now on; for who loads NumPy before this package too, whose environment comes late."""
    threadpool_limits(limits=1, user_api="blas")
