"""A baseline: the cross-entropy method over a policy action = tanh(W · observation + b), by NumPy alone.
Rubinstein, 1999, doi:10.1023/A:1010091220143; with added noise as Szita and Lőrincz, 2006, doi:10.1162/neco.2006.18.12.2936."""
import numpy as np

from .environment import make_vector

COLUMNS = (0, 1, 2, 7, 11, 16, 17, 18)  # goal minus tip, jaw, holds, where tissue has to go


def act(weights, observations, columns=COLUMNS):
    """@param weights (..., actions, columns + 1); one policy, or one for each observation"""
    seen = np.append(observations[..., list(columns)], np.ones(observations.shape[:-1] + (1,)), -1)
    return np.tanh(np.einsum("...ij,...j->...i", weights, seen))


def random_policy(seed=0):
    random = np.random.default_rng(seed)
    return lambda observations: random.uniform(-1, 1, (len(observations), 6))


def returns(env, policy, seed):
    """One episode in each of its environments. @return score at the end and whether it was passed, each"""
    observations, _ = env.reset(seed=seed)
    score, passed, over = np.zeros(env.num_envs), np.zeros(env.num_envs, bool), np.zeros(env.num_envs, bool)
    while not over.all():
        observations, _, terminated, truncated, info = env.step(policy(observations))
        score[~over], passed[~over] = info["score"][~over], info["passed"][~over]
        over |= terminated | truncated
    return score, passed


def train(task, generations=12, population=32, episodes=2, elite=0.2, seed=0, columns=COLUMNS, tell=None, **options):
    """@param population policies a generation  @param episodes of each policy, the same starts for all in a generation
    @param tell called with generation, mean and greatest score  @param options of make_vector
    @return weights of the mean policy"""
    random = np.random.default_rng(seed)
    env = make_vector(task, population * episodes, **options)
    shape = (env.single_action_space.shape[0], len(columns) + 1)
    mean, deviation = np.zeros(shape), np.full(shape, 1.0)
    best = max(2, int(elite * population))
    for generation in range(generations):
        tried = mean + deviation * random.normal(size=(population,) + shape)
        each = np.repeat(tried, episodes, 0)
        seeds = np.tile(random.integers(2**31, 2**32, episodes), population)
        score = returns(env, lambda seen: act(each, seen, columns), seeds)[0].reshape(population, episodes).mean(1)
        chosen = tried[np.argsort(score)[-best:]]
        mean, deviation = chosen.mean(0), chosen.std(0) + 0.3 / (generation + 1)
        if tell:
            tell(generation, score.mean(), score.max())
    env.close()
    return mean
