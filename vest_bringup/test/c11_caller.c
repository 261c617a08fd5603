#include "vest_bringup/vest.h"

/* vest.h is C11: one episode by a caller in C. @return code; *hash of the tissue at its end */
int vest_test_episode(const char* task, const char* scene, const char* box, uint64_t seed, int steps, uint64_t* hash) {
  vest_model_options options = {.struct_size = sizeof options, .task = task, .scene = scene, .box = box};
  vest_handle model = 0, env = 0;
  float action[6], observation[21];
  vest_result result = {.struct_size = sizeof result};
  int code = vest_model_load(&options, &model);
  if (code == VEST_OK) code = vest_env_new(model, 1, &env);
  if (code == VEST_OK) code = vest_reset(env, seed, observation, 21);
  for (int k = 0; k < steps && code == VEST_OK; ++k) {
    code = vest_expert(env, action, 6);
    if (code == VEST_OK) code = vest_step(env, action, 6, observation, 21, &result);
  }
  if (code == VEST_OK) code = vest_hash(env, hash);
  vest_close(env);
  vest_close(model);
  return code;
}
