#!/usr/bin/env bash
# Bullet 3.24 (Debian's libbullet-dev 3.24+dfsg-2): btSoftRigidDynamicsWorld::setGravity.
# Guess: cloth falls along the gravity of the world it was added to.
# Seen: soft bodies keep the gravity of btSoftBodyWorldInfo, (0, -10, 0) by default: in a world set
#   to (0, 0, -9.81) a rigid body falls 4.99 m along z in a second, the cloth 5.08 m along y.
#   Setting getWorldInfo().m_gravity moves it.
# For users of Atelier: a scene with Z up, or at 9.81, dresses its body sideways and 2% too
#   fast until both are set.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages libbullet-dev=3.24+dfsg-2

# Valid: a rigid sphere and a free patch of Bullet's helper far apart, sixty steps of 1/60 s.
cat > seen.cpp <<'CC'
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <cstdio>

int main() {
  for (bool both : {false, true}) {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(btVector3(0, 0, -9.81));
    btSoftBodyWorldInfo& info = world.getWorldInfo();
    if (both) {
      info.m_gravity = world.getGravity();
    }
    info.m_sparsesdf.Initialize();
    btSoftBody* cloth = btSoftBodyHelpers::CreatePatch(
        info, btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 1, 0), btVector3(1, 1, 0), 11,
        11, 0, true);
    const btVector3 start = cloth->m_nodes[60].m_x;
    world.addSoftBody(cloth);
    btSphereShape shape(0.1);
    btRigidBody ball(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &shape));
    ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(50, 0, 0)));
    world.addRigidBody(&ball);
    for (int i = 0; i < 60; ++i) {
      world.stepSimulation(1 / 60., 0);
    }
    const btVector3 fall = cloth->m_nodes[60].m_x - start;
    std::printf("%s: ball z %.2f, cloth y %.2f z %.2f\n",
                both ? "gravity set in both places" : "setGravity of the world alone",
                ball.getWorldTransform().getOrigin().z(), fall.y(), fall.z());
    world.removeRigidBody(&ball);
    world.removeSoftBody(cloth);
  }
}
CC
g++ -std=c++17 -o seen seen.cpp -isystem /usr/include/bullet -lBulletSoftBody -lBulletDynamics \
  -lBulletCollision -lLinearMath
seen=$(./seen | sed 's/-0\.00/0.00/g')
printf '%s\n' "$seen"
expected='setGravity of the world alone: ball z -4.99, cloth y -5.08 z 0.00
gravity set in both places: ball z -4.99, cloth y 0.00 z -4.99'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: Bullet's cloth takes its gravity otherwise than recorded"
  exit 1
fi
