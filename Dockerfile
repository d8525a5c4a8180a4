# One image for service and worker: the command says which. Builds from this folder alone:
#   docker build -t grazemap .
# The digest is that of all platforms, with Python 3.11.15, as docker-library/repo-info recorded it on 2026-08-05.
# Dependabot proposes newer ones; --build-arg PYTHON_IMAGE=python:3.11-slim takes what the tag names now.
ARG PYTHON_IMAGE=python:3.11-slim@sha256:90744cff8f32887f075c47d747a173ff333e9e98801667af93c357fa9f5e28ff
FROM ${PYTHON_IMAGE} AS build
WORKDIR /source
COPY requirements.lock ./
# its first part: what runs
RUN python -m venv /opt/grazemap \
 && sed '/^# what tests need$/,$d' requirements.lock > running.lock \
 && /opt/grazemap/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes -r running.lock
COPY pyproject.toml README.md LICENSE ./
COPY tools/package_readme.py tools/
COPY sdk sdk
COPY core core
COPY worker worker
COPY service service
RUN /opt/grazemap/bin/python -m pip install --no-cache-dir --disable-pip-version-check --no-deps --no-build-isolation .
# The kernels, compiled ahead of time; a processor that they do not fit compiles its own.
COPY tools/kernels_wheel.py tools/
RUN test "$(uname -m)" != x86_64 || ( \
    /opt/grazemap/bin/python tools/kernels_wheel.py /kernels \
 && /opt/grazemap/bin/python -m pip install --no-cache-dir --disable-pip-version-check --no-deps /kernels/*.whl )

FROM ${PYTHON_IMAGE}
# Compiled kernels are kept in a folder that the user owns; a volume there saves the compilation after an upgrade.
ENV PATH=/opt/grazemap/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    GRAZEMAP_CACHE_DIR=/var/cache/grazemap
RUN useradd --system --uid 10001 --home-dir /nonexistent --no-create-home grazemap \
 && install -d -o grazemap -g grazemap -m 0700 /var/cache/grazemap
COPY --from=build /opt/grazemap /opt/grazemap
USER grazemap
EXPOSE 8000
CMD ["python", "-m", "grazemap_service"]
