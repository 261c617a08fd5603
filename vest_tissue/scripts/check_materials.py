#!/usr/bin/env python3
"""Checks that every number of a material database says where it is from.

usage: check_materials.py [FILE]      exit 0: good; 1: one line per fault: file, material, state, quantity, what is wrong
"""
import math
import os
import sys

import yaml

NEEDED = ['fat_soft', 'fat_firm', 'liver', 'spleen', 'heart_muscle', 'kidney', 'uterus', 'tube', 'ovary', 'ligament',
          'peritoneum', 'intestine', 'gallbladder', 'bile_duct', 'artery', 'vein', 'skin', 'bone']
SOURCED = {'value', 'source', 'place', 'quoted', 'strain'}
ASSUMED = {'value', 'assumed', 'why'}


def faults_of_number(number, sources):
    if not isinstance(number, dict):
        return ['is not a map of value and source']
    value = number.get('value')
    found = []
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        found.append('value %r is not a finite number' % (value,))
    if 'assumed' in number:
        if number['assumed'] is not True:
            found.append('assumed: %r (allowed: true, or leave it out)' % (number['assumed'],))
        wanted, words = ASSUMED, ['why']
    else:
        wanted, words = SOURCED, ['source', 'place', 'quoted', 'strain']
        if number.get('source') not in sources:
            found.append('source %r is not in sources' % (number.get('source'),))
    found += ['lacks %s' % key for key in sorted(wanted - set(number))]
    found += ['unknown key %s' % key for key in sorted(set(number) - wanted)]
    found += ['%s is empty' % key for key in words if key in number and len(str(number[key]).strip()) < 3
              and key != 'strain']
    return found


def faults_of(path):
    with open(path, encoding='utf-8') as file:
        data = yaml.safe_load(file)
    found = []
    units, sources = data.get('units', {}), data.get('sources', {})
    for key, text in sources.items():
        if not any(mark in text for mark in ('doi', 'PMC', 'PMID', ' et al', 'ICRP', 'ICRU', '(', 'table')):
            found.append('%s: sources: %s: %r names no publication' % (path, key, text))
    names, used = [], set()
    for material in data.get('materials', []):
        name = material.get('name')
        names.append(name)
        for state in ('in_vivo', 'post_mortem'):
            entries = dict(material.get(state) or {})
            if state == 'post_mortem':
                if len(str(entries.pop('others', ''))) < 10:
                    found.append('%s: %s: %s: others: says nothing of the numbers that are not listed' % (path, name, state))
            else:
                found += ['%s: %s: %s: %s: is missing' % (path, name, state, key)
                          for key in units if key not in entries]
            for key, number in entries.items():
                if key not in units:
                    found.append('%s: %s: %s: %s: has no unit' % (path, name, state, key))
                found += ['%s: %s: %s: %s: %s' % (path, name, state, key, fault)
                          for fault in faults_of_number(number, sources)]
                if isinstance(number, dict):
                    used.add(number.get('source'))
    found += ['%s: materials: %s: is missing' % (path, name) for name in NEEDED if name not in names]
    found += ['%s: materials: %s: stands twice' % (path, name) for name in sorted(set(names)) if names.count(name) > 1]
    found += ['%s: sources: %s: nothing refers to it' % (path, key) for key in sources if key not in used]
    return found


def main():
    if sys.argv[1:] in (['-h'], ['--help']):
        print(__doc__)
        return 0
    here = os.path.dirname(os.path.abspath(__file__))
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, '..', 'data', 'materials.yaml')
    try:
        found = faults_of(path)
    except (OSError, yaml.YAMLError, AttributeError, TypeError) as error:
        found = ['%s: %s' % (path, str(error).replace('\n', ' '))]
    for line in found:
        print(line)
    if not found:
        print('%s: every number has its source, or says that it is assumed' % os.path.basename(path))
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
