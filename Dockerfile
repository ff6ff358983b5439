# heptarm with its virtual cabinet: `docker build -t heptarm . && docker run --rm heptarm` runs the demo.
# Packages come from scripts/lock, as everywhere; the stage `dev` has the tools of the developers as well.
FROM debian:12 AS user
# Versions are not pinned: a release of Debian drops old versions of its packages from its servers.
# hadolint ignore=DL3008
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
    ca-certificates git make python3 python3-venv gcc libc6-dev openjdk-17-jdk-headless ecj \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /heptarm
COPY . .
RUN make native cabinet
ENV PATH=/heptarm/.venv/bin:$PATH
ENTRYPOINT ["heptarm"]
CMD ["demo"]

FROM user AS dev
RUN make setup
ENTRYPOINT []
CMD ["bash"]

FROM user
