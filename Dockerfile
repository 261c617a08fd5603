# The headless demo in a container, and a room to develop in. See docs/container.md.
#   docker build -t vest .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD/out:/out" vest
FROM debian:12 AS packages
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
ENV LC_ALL=C.UTF-8 ROS_HOSTNAME=localhost
COPY .ci/packages.txt /tmp/packages.txt
RUN apt-get update \
 && sed -e 's/#.*//' -e '/^[[:space:]]*$/d' /tmp/packages.txt \
    | DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends python3 \
 && rm -rf /var/lib/apt/lists/*

# What ./test and lint need, too: the devcontainer.
FROM packages AS develop
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
COPY .ci/packages_test.txt /tmp/packages_test.txt
RUN apt-get update \
 && sed -e 's/#.*//' -e '/^[[:space:]]*$/d' /tmp/packages_test.txt \
    | DEBIAN_FRONTEND=noninteractive xargs apt-get install -y --no-install-recommends sudo \
 && rm -rf /var/lib/apt/lists/* \
 && useradd --create-home --shell /bin/bash vest \
 && echo 'vest ALL=(ALL) NOPASSWD:ALL' > /etc/sudoers.d/vest
USER vest

# The demo: built as ./run builds it.
FROM packages AS demo
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
COPY . /vest
WORKDIR /vest
RUN . .ci/common.sh \
 && configure /vest/build/run -DCATKIN_ENABLE_TESTING=OFF -DVEST_DEVELOPER_TOOLS=OFF \
 && build /vest/build/run \
 && rm -rf ~/.cache \
 && mkdir /out && chmod 1777 /out
# Any user may run it: nothing is written but /out and /tmp. (roslaunch asks for a user's name.)
ENV HOME=/tmp USER=vest VEST_RUN_FOLDER=/tmp
USER nobody
ENTRYPOINT ["/bin/bash", "-c", ". build/run/devel/setup.bash && exec /usr/bin/python3 vest_bringup/scripts/run_session --headless \"$@\"", "vest"]
CMD ["--seconds", "20", "--output", "/out/session"]
