#!/usr/bin/env python3
"""The shipped database passes check_materials.py, and a copy that lacks anything does not."""
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPT = os.path.join(HERE, '..', '..', 'scripts', 'check_materials.py')
DATABASE = os.path.join(HERE, '..', '..', 'data', 'materials.yaml')


def check(text):
    with tempfile.NamedTemporaryFile('w', suffix='.yaml', encoding='utf-8') as file:
        file.write(text)
        file.flush()
        run = subprocess.run([sys.executable, SCRIPT, file.name], stdout=subprocess.PIPE, universal_newlines=True)
    return run.returncode, run.stdout


class Materials(unittest.TestCase):
    def setUp(self):
        with open(DATABASE, encoding='utf-8') as file:
            self.text = file.read()

    def test_the_shipped_database_is_complete(self):
        code, output = check(self.text)
        self.assertEqual((code, output.count('\n')), (0, 1), output)

    def broken(self, old, new, words):
        self.assertIn(old, self.text)
        code, output = check(self.text.replace(old, new, 1))
        self.assertEqual(code, 1, 'accepted: %s' % new)
        for word in words:
            self.assertIn(word, output)

    def test_a_number_without_source_is_found(self):
        self.broken(', source: arda', '', ['kidney', 'in_vivo', 'youngs_modulus', 'lacks source'])

    def test_a_number_with_an_unknown_source_is_found(self):
        self.broken('source: kiss', 'source: nobody', ['uterus', 'nobody'])

    def test_an_assumption_without_reason_is_found(self):
        self.broken(', why: "relaxed muscle', ', because: "relaxed muscle', ['heart_muscle', 'lacks why'])

    def test_a_quantity_that_is_missing_is_found(self):
        at = self.text.index('      cut_toughness: {', self.text.index('name: skin'))
        line = self.text[at:self.text.index('\n', at) + 1]
        self.broken(line, '', ['skin', 'cut_toughness', 'missing'])

    def test_a_value_that_is_no_number_is_found(self):
        self.broken('{value: 5000, source: arda', '{value: .nan, source: arda', ['kidney', 'finite'])

    def test_a_material_that_is_missing_is_found(self):
        self.broken('- name: vein', '- name: wein', ['vein', 'missing'])


if __name__ == '__main__':
    unittest.main()
