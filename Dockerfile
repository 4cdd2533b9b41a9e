# The engine, the program and what it needs, at the versions that the tests ran with. From the checkout's top level:
#
#   docker build --build-arg COMMIT=$(git rev-parse HEAD) -t granular-walkers .
#   docker run --rm -v "$PWD:/work" granular-walkers run fig1b
FROM debian:bookworm

# The commit, for the manifests of runs: git does not come along.
ARG COMMIT=""

# The Makefile lists the Debian packages of the engine.
COPY Makefile /tmp/
RUN apt-get update \
 && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends make python3 python3-venv \
 && make -C /tmp engine \
 && rm -rf /var/lib/apt/lists/*

COPY . /opt/granular-walkers
RUN cd /opt/granular-walkers \
 && python3 -m venv /opt/venv \
 && version=$(sed -n 's/^fallback_version = "\(.*\)"$/\1/p' pyproject.toml) \
 && SETUPTOOLS_SCM_PRETEND_VERSION="$version${COMMIT:++g$COMMIT}" \
    /opt/venv/bin/pip install --no-cache-dir --disable-pip-version-check -c requirements.txt '.[all]' \
 && rm -rf build ./*.egg-info \
 && /opt/venv/bin/walkers show fig1b > /dev/null

# Nothing may write into the image where it is somebody else's, as on a cluster: caches go where all may write.
ENV PATH=/opt/venv/bin:$PATH \
    NUMBA_CACHE_DIR=/tmp/numba \
    MPLCONFIGDIR=/tmp/matplotlib

WORKDIR /work
ENTRYPOINT ["walkers"]
