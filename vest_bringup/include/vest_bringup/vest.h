#pragma once

/** VEST from C (C11) and from whatever calls C: the tissue World, and the Trainer as tasks for learning. No
 * ROS.
 *
 * Handles are numbers, 0 is none. They are never used twice: a closed one is refused. Each function returns a
 * code of vest_code and throws nothing; vest_error() tells what was wrong. A handle serves one thread at a
 * time, a second one gets VEST_BUSY. Different handles run at once, also those that share a model. Structures
 * begin with their size, which the caller sets: sizeof the structure. Units are SI, the frame is world
 * (docs/conventions.md). docs/learning.md explains tasks and observations. */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VEST_API __attribute__((visibility("default")))

typedef uint64_t vest_handle;

enum vest_code {
  VEST_OK = 0,
  VEST_BAD_HANDLE = 1, /**< closed, never opened, or of another kind */
  VEST_BAD_ARGUMENT =
      2,            /**< NULL, a wrong size, a number or a word that is not allowed; nothing has changed */
  VEST_REFUSED = 3, /**< a file or a snapshot that cannot be used; nothing has changed */
  VEST_BUSY = 4,    /**< another thread is using this handle */
  VEST_FAULT = 5,   /**< a step ended in a fault; the last good state was kept */
  VEST_OVER = 6,    /**< the episode is over: reset it first */
  VEST_INTERNAL = 7 /**< out of memory, or a mistake of VEST */
};

/** What was wrong with the last call on a handle, or, for handle 0, with the calling thread's last call that
 * failed. Valid until the thread's next call of vest_error. Empty: nothing. Never NULL. */
VEST_API const char* vest_error(vest_handle handle);
/** Version of the library, e.g. "0.1.0". */
VEST_API const char* vest_version(void);
VEST_API int vest_close(vest_handle handle);

/** Tissue alone.  @param scene scene file  @param threads 1 … 64; results are the same bits for any */
typedef struct vest_world_options {
  size_t struct_size;
  const char* scene;
  int32_t threads;
} vest_world_options;
VEST_API int vest_world_new(const vest_world_options* options, vest_handle* world);
/** Steps of the scene's dt without instruments. */
VEST_API int vest_world_step(vest_handle world, uint64_t steps);

/** An instrument, as vest_msgs/ToolInput: m, rad, world. */
typedef struct vest_tool {
  int32_t present;
  int32_t tool;       /**< InstrumentState.TOOL_* */
  uint32_t functions; /**< bits of InstrumentState.FUNCTION_* */
  double position[3], orientation[4], pivot[3];
  double jaw;
  double sight[3];
} vest_tool;
typedef struct vest_edit {
  const char* object; /**< "": the world */
  const char* parameter;
  double value;
} vest_edit;
typedef struct vest_impact {
  uint32_t object, triangle; /**< indices */
  double weights[3], momentum[3];
} vest_impact;
typedef struct vest_load {
  uint32_t object, knot; /**< indices */
  float force[3], damping, stiffness, depth;
} vest_load;
typedef struct vest_dilatation {
  const char* vessel_segment;
  float dilatation[4]; /**< radius over reference radius at 0, 1/3, 2/3 and 1 of the segment's length */
} vest_dilatation;

/** Everything that a step consumes: what a session records as vest_msgs/StepInput, whose fields these are. */
typedef struct vest_input {
  size_t struct_size;
  uint64_t step; /**< the next one, or 0 */
  double dt;     /**< s, 1e-6 … 0.01; 0: the scene's */
  uint32_t seed;
  vest_tool tools[4]; /**< left, right, third, endoscope */
  const vest_edit* edits;
  size_t edit_count;
  const vest_impact* impacts;
  size_t impact_count;
  const vest_load* loads;
  size_t load_count;
  double load_over; /**< s */
  const vest_dilatation* dilatations;
  size_t dilatation_count;
  double sunk; /**< m, 0 … 1 */
  const char* const* requests;
  size_t request_count;
} vest_input;
/** One step with an input. Recorded inputs give the recorded vest_hash(). VEST_REFUSED where a field is out
 * of range: nothing has moved then. */
VEST_API int vest_world_step_input(vest_handle world, const vest_input* input);

/** Scene and task, loaded once and shared by any number of environments, which keep it alive. */
typedef struct vest_model_options {
  size_t struct_size;
  const char* task;    /**< one of vest_task_name(), or the path of an exercise file */
  const char* scene;   /**< scene file */
  const char* box;     /**< trainer_box.yaml */
  const char* vessels; /**< folder of the vessels' database; NULL: without effects. Exercises need it */
  int32_t skip;        /**< simulated steps for one action, 1 … 1000; 0: 20 */
  double limit_s;      /**< s until an episode is truncated; 0: the task's */
} vest_model_options;
VEST_API int vest_model_load(const vest_model_options* options, vest_handle* model);
/** Scene of vest_tissue that a task or an exercise file is made for, "" where there is none. Valid until the
 * thread's next call. */
VEST_API const char* vest_task_scene(const char* task);
/** Name of a task, NULL beyond the last one. */
VEST_API const char* vest_task_name(size_t index);

/** Numbers of an action of one hand, and of an observation: of the tasks that have a name. */
VEST_API size_t vest_action_size(void);
VEST_API size_t vest_observation_size(void);
/** Numbers of an action of a model's task: vest_action_size(), or twice as many where both hands act
 * (`tie_throw`): those of the right hand, then those of the left one. Of an exercise: 8 for each instrument
 * that acts, in the order right, left, third, endoscope. */
VEST_API int vest_model_action_size(vest_handle model, size_t* numbers);
/** Numbers of an observation of a model's task. */
VEST_API int vest_model_observation_size(vest_handle model, size_t* numbers);
/** What one of them is, with its unit. @param text cut off to capacity, with its 0 */
VEST_API int vest_model_observation_name(vest_handle model, size_t index, char* text, size_t capacity);

typedef struct vest_result {
  size_t struct_size;
  double reward; /**< change of the score */
  double score;  /**< 0 … 1 */
  int32_t terminated, truncated, passed;
} vest_result;

VEST_API int vest_env_new(vest_handle model, int32_t threads, vest_handle* env);
/** @param count of the observation's numbers: vest_model_observation_size() */
VEST_API int vest_reset(vest_handle env, uint64_t seed, float* observation, size_t count);
/** @param action action_count numbers in [-1, 1]: vest_model_action_size(). Others count as the nearer end,
   NaN and infinite ones as 0 */
VEST_API int vest_step(vest_handle env, const float* action, size_t action_count, float* observation,
                       size_t count, vest_result* result);
/** The action of a script that sees the scene. */
VEST_API int vest_expert(vest_handle env, float* action, size_t action_count);
/** Tip of the instrument as commanded; the right one where both hands act. @param pose 8 numbers: x y z (m,
 * world), quaternion x y z w (z along the shaft, away from the trocar), opening of the jaw (rad) */
VEST_API int vest_tip(vest_handle env, double* pose, size_t count);
VEST_API int vest_observe(vest_handle env, float* observation, size_t count);
/** An exercise's result as it stands, as JSON: items with values, points and marks, what failed, the total.
 * @param json NULL: the size alone  @param size in: room; out: bytes with the 0. VEST_REFUSED: no exercise */
VEST_API int vest_exercise_result(vest_handle env, char* json, size_t* size);

/** What the endoscope sees now: shaded surfaces without textures, 70 degrees wide.
 * @param width, height 8 … 1024  @param rgb width times height times 3, rows from above  @param rgb_count,
 * depth_count their sizes  @param depth m along the line of sight, 0: nothing; width times height */
VEST_API int vest_picture(vest_handle env, int32_t width, int32_t height, uint8_t* rgb, size_t rgb_count,
                          float* depth, size_t depth_count);

/** n environments on threads. An environment whose episode is over is reset by its next step, with its seed +
 * n. */
VEST_API int vest_vec_new(vest_handle model, size_t environments, int32_t threads, vest_handle* vec);
/** @param seeds n of them  @param count n times vest_model_observation_size() */
VEST_API int vest_vec_reset(vest_handle vec, const uint64_t* seeds, size_t environments, float* observations,
                            size_t count);
/** @param action_count n times vest_model_action_size()  @param results n of them; struct_size of the first
 * one counts */
VEST_API int vest_vec_step(vest_handle vec, const float* actions, size_t action_count, float* observations,
                           size_t count, vest_result* results, size_t environments);
/** The pictures of all, one behind the other. @param rgb_count, depth_count n times those of vest_picture */
VEST_API int vest_vec_picture(vest_handle vec, int32_t width, int32_t height, uint8_t* rgb, size_t rgb_count,
                              float* depth, size_t depth_count);
VEST_API int vest_vec_expert(vest_handle vec, float* actions, size_t action_count);

/* The following take worlds and environments. */

VEST_API int vest_objects(vest_handle handle, size_t* objects);
/** @param text cut off to capacity, with its 0 */
VEST_API int vest_object_name(vest_handle handle, size_t object, char* text, size_t capacity);
VEST_API int vest_knots(vest_handle handle, size_t object, size_t* knots);
/** @param xyz m, world, x y z per knot  @param count 3 times vest_knots() */
VEST_API int vest_positions(vest_handle handle, size_t object, float* xyz, size_t count);
/** Living triangles of knots that others touch. @param indices three per triangle; NULL: their number alone
 * @param count in: room (numbers); out: how many there are. Too little room: VEST_BAD_ARGUMENT, and count
 * tells. */
VEST_API int vest_triangles(vest_handle handle, size_t object, uint32_t* indices, size_t* count);
/** Steps since loading or reset, and simulated time, s. */
VEST_API int vest_time(vest_handle handle, uint64_t* steps, double* seconds);
/** XXH64 of the tissue's State: what sessions record as tissue/state_hash. */
VEST_API int vest_hash(vest_handle handle, uint64_t* hash);
/** Everything that evolves. @param bytes NULL: the size alone  @param size in: room; out: bytes. Too little
 * room: VEST_BAD_ARGUMENT, and size tells. */
VEST_API int vest_save(vest_handle handle, uint8_t* bytes, size_t* size);
VEST_API int vest_restore(vest_handle handle, const uint8_t* bytes, size_t size);

#ifdef __cplusplus
}
#endif
