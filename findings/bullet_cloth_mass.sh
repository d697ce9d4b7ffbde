#!/usr/bin/env bash
# Bullet 3.24 (Debian's libbullet-dev 3.24+dfsg-2, single precision): masses of a soft body.
# Guess: a cloth of CreatePatch has a total mass near 1; setTotalMass keeps what is pinned;
#   addForce(f) ("to the entire body", says its header) applies f to the body.
# Seen: a patch of 11 x 11 weighs 121 kg. A corner pinned by setMass(0, 0) stays so under
#   setTotalMass(0.5), but setTotalMass(0.5, true) (by faces) sets it free: inverse mass 1200.
#   addForce(1 N) on a body of 1 kg for one step of 1/60 s gives 2.017 m/s for 0.017: every node
#   gets it, and so 121 times.
# For users of Atelier: when a garment is compared with Bullet's, set masses by faces first, pin
#   after that, and divide forces by the number of nodes.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages libbullet-dev=3.24+dfsg-2

# Valid: only public functions, a patch of Bullet's own helper, no collision.
cat > seen.cpp <<'CC'
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <cstdio>

btSoftBody* patch(btSoftBodyWorldInfo& info) {
  return btSoftBodyHelpers::CreatePatch(info, btVector3(0, 0, 0), btVector3(1, 0, 0),
                                        btVector3(0, 0, 1), btVector3(1, 0, 1), 11, 11, 0, true);
}

int main() {
  btSoftBodyWorldInfo info;
  btSoftBody* cloth = patch(info);
  std::printf("default mass %.0f\n", cloth->getTotalMass());
  for (bool faces : {false, true}) {
    btSoftBody* pinned = patch(info);
    pinned->setMass(0, 0);
    pinned->setTotalMass(0.5, faces);
    std::printf("pinned, then setTotalMass(0.5, %d): inverse mass %.0f, total %.2f\n", faces,
                pinned->m_nodes[0].m_im, pinned->getTotalMass());
  }
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.getWorldInfo().m_gravity = btVector3(0, 0, 0);
  world.getWorldInfo().m_sparsesdf.Initialize();
  btSoftBody* pushed = patch(world.getWorldInfo());
  pushed->setTotalMass(1);
  world.addSoftBody(pushed);
  pushed->addForce(btVector3(0, 1, 0));
  world.stepSimulation(1 / 60., 0);
  double speed = 0;
  for (int i = 0; i < pushed->m_nodes.size(); ++i) {
    speed += pushed->m_nodes[i].m_v.y() / pushed->m_nodes.size();
  }
  std::printf("1 N on 1 kg for 1/60 s: %.3f m/s\n", speed);
}
CC
g++ -std=c++17 -o seen seen.cpp -isystem /usr/include/bullet -lBulletSoftBody -lBulletDynamics \
  -lBulletCollision -lLinearMath
seen=$(./seen)
printf '%s\n' "$seen"
expected='default mass 121
pinned, then setTotalMass(0.5, 0): inverse mass 0, total 0.50
pinned, then setTotalMass(0.5, 1): inverse mass 1200, total 0.50
1 N on 1 kg for 1/60 s: 2.017 m/s'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: Bullet treats masses of soft bodies otherwise than recorded"
  exit 1
fi
