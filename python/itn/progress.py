"""progress=True shows a bar (tqdm, where it is installed); progress=f calls f(fraction) now and then."""
import contextlib


@contextlib.contextmanager
def shown(progress, label):
    """What the libraries are to call with the fraction done, or None."""
    if progress is None or progress is False:
        yield None
        return
    if progress is not True:
        yield progress
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    with tqdm(total=100, desc=label, unit="%", leave=False, bar_format="{desc} {percentage:3.0f} % {bar} {remaining} left") as bar:
        def update(fraction):
            bar.update(max(0, round(100 * fraction) - bar.n))
        yield update
