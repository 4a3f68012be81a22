# SPDX-License-Identifier: BSD-3-Clause
import os
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np

from training.segmentation import augmentation, clutter, datasets, label_set, mixture

NO_DECOYS = augmentation.Decoys([], [])
SHARED = Path(os.environ.get("ROSLAM_TEST_DATA", "../shared/data"))


class LabelSets(unittest.TestCase):
    def test_every_grouping_covers_each_class_at_most_once(self):
        for groups in (label_set.GROUPS8, label_set.CAMVID11, label_set.PERSON1):
            members = [c for classes in groups.values() for c in classes]
            self.assertEqual(sorted(members), list(range(19)))

    def test_lookups_say_void_where_nothing_is_known(self):
        self.assertEqual(label_set.FROM_TRAIN_IDS[18], 18)
        self.assertEqual(label_set.FROM_TRAIN_IDS[255], label_set.VOID)
        self.assertEqual(label_set.FROM_CAMVID[11], label_set.VOID)
        self.assertEqual(label_set.SETS[label_set.FROM_CAMVID[5]], (8, 9))
        self.assertEqual(label_set.SETS[label_set.FROM_PERSON_MASK[255]], (11, 12))
        self.assertEqual(label_set.FROM_CITYSCAPES_IDS[24], 11)
        self.assertEqual(label_set.FROM_CITYSCAPES_IDS[0], label_set.VOID)


def one_picture_set(name="rooms"):
    rng = np.random.default_rng(1)
    labels = np.zeros((120, 160), np.uint8)
    labels[:, 80:] = 2
    picture = np.zeros((120, 160, 3), np.uint8)
    picture[:, 80:] = 200
    picture += rng.integers(0, 20, picture.shape, np.uint8)
    return datasets.LabelledPictures(name, [picture], [labels])


def red_person():
    mask = np.zeros((90, 30), np.uint8)
    mask[5:85, 8:22] = 255
    return np.full((90, 30, 3), (255, 0, 0), np.uint8), mask


class DecoysInCrops(unittest.TestCase):
    def test_things_are_drawn_and_labelled_static(self):
        mask = np.full((60, 60), 255, np.uint8)
        green = np.full((60, 60, 3), (0, 255, 0), np.uint8)
        options = augmentation.AugmentationOptions(decoys=1.0, hide=0.0, grey=0.0, blur=0.0, noise=0.0, compression=0.0)
        static = label_set.set_number(label_set.STATIC)
        found = 0
        for seed in range(10):
            picture, labels = augmentation.augment(np.random.default_rng(seed), *one_picture_set()[0], [],
                                                   augmentation.Decoys([], [(green, mask)]), options)
            green_pixels = picture[..., 1].astype(int) > picture[..., 0].astype(int) + 90
            found += green_pixels.any()
            if green_pixels.any():
                self.assertGreater((labels[green_pixels] == static).mean(), 0.95)
        self.assertGreater(found, 5)

    def test_pictures_in_which_something_may_move_give_none(self):
        rooms = one_picture_set("rooms")
        picture, labels = rooms[0]
        rooms.pictures.append(picture)
        rooms.labels.append(np.full_like(labels, label_set.set_number(label_set.STATIC)))
        rooms.labels[0] = np.full_like(labels, label_set.set_number(label_set.NOT_PERSON))
        self.assertEqual(len(mixture.static_pictures([rooms])), 1)
        self.assertEqual(mixture.static_pictures([one_picture_set("camvid")]), [])

    def test_both_sources_are_drawn_from_and_none_needs_to_be_there(self):
        mask = np.full((20, 20), 255, np.uint8)
        thing = (np.zeros((20, 20, 3), np.uint8), mask)
        picture = np.full((100, 100, 3), 9, np.uint8)
        rng = np.random.default_rng(1)
        drawn = [augmentation.Decoys([picture], [thing]).draw(rng) for _ in range(20)]
        self.assertEqual({int(d[0].max()) for d in drawn}, {0, 9})
        self.assertIsNone(NO_DECOYS.draw(rng))


class ThingsInFront(unittest.TestCase):
    def test_what_they_cover_is_static_and_the_rest_stays(self):
        nothing = {"hide": 0.0, "grey": 0.0, "blur": 0.0, "noise": 0.0, "compression": 0.0}
        static = label_set.set_number(label_set.STATIC)
        covered = 0
        for seed in range(10):
            crops = [augmentation.augment(np.random.default_rng(seed), *one_picture_set()[0], [], NO_DECOYS,
                                          augmentation.AugmentationOptions(things=share, **nothing)) for share in (0, 1)]
            is_changed = crops[0][1] != crops[1][1]
            covered += is_changed.any()
            self.assertTrue((crops[1][1][is_changed] == static).all())
        self.assertGreater(covered, 5)


class MadeUpClutter(unittest.TestCase):
    def test_a_picture_depends_on_its_number_alone_and_is_static(self):
        data = clutter.Clutter()
        picture, labels = data[3]
        self.assertTrue(np.array_equal(picture, data[3][0]))
        self.assertFalse(np.array_equal(picture, data[4][0]))
        self.assertEqual(picture.shape, (*labels.shape, 3))
        self.assertEqual(set(np.unique(labels)), {label_set.set_number(label_set.STATIC)})

    def test_most_pictures_show_something(self):
        data = clutter.Clutter()
        spread = [float(data[i][0].std()) for i in range(12)]
        self.assertGreater(np.median(spread), 10)


class Samples(unittest.TestCase):
    def setUp(self):
        self.samples = mixture.Mixture([one_picture_set()], [red_person()], NO_DECOYS, 3)

    def test_a_sample_depends_on_seed_and_number_alone(self):
        again = mixture.Mixture([one_picture_set()], [red_person()], NO_DECOYS, 3)
        again[7]
        for number in (5, 0, 5):
            self.assertTrue(all(np.array_equal(a, b) for a, b in zip(self.samples[number], again[number])))
        other = mixture.Mixture([one_picture_set()], [red_person()], NO_DECOYS, 4)
        self.assertFalse(np.array_equal(self.samples[0][0], other[0][0]))

    def test_crops_have_the_size_and_known_labels(self):
        for number in range(20):
            picture, labels = self.samples[number]
            self.assertEqual((picture.shape, labels.shape), ((256, 256, 3), (256, 256)))
            static = label_set.set_number(label_set.STATIC)
            self.assertTrue(set(np.unique(labels)) <= {0, 2, 11, static, label_set.VOID})

    def test_labels_follow_the_picture(self):
        plain = augmentation.AugmentationOptions(roll=5)
        data = one_picture_set()
        for seed in range(10):
            picture, labels = augmentation.crop(np.random.default_rng(seed), *data[0], plain)
            bright = picture.mean(2) > 110
            known = labels != label_set.VOID
            wrong = (bright != (labels == 2)) & known
            self.assertLess(wrong.mean(), 0.02)

    def test_a_pasted_person_is_labelled_where_it_is_seen(self):
        options = augmentation.AugmentationOptions(hide=0)
        for seed in range(10):
            picture = np.zeros((256, 256, 3), np.uint8)
            labels = np.zeros((256, 256), np.uint8)
            augmentation.paste_cutout(np.random.default_rng(seed), picture, labels, *red_person(), 11, options)
            red = picture[..., 0] > 70
            self.assertLess((red != (labels == 11)).mean(), 0.02)


class Readers(unittest.TestCase):
    def test_the_official_layout_of_cityscapes(self):
        with tempfile.TemporaryDirectory() as folder:
            for part in ("leftImg8bit", "gtFine"):
                (Path(folder) / part / "train/bonn").mkdir(parents=True)
            stem = "bonn_000000_000019"
            cv2.imwrite(f"{folder}/leftImg8bit/train/bonn/{stem}_leftImg8bit.png", np.zeros((64, 128, 3), np.uint8))
            cv2.imwrite(f"{folder}/gtFine/train/bonn/{stem}_gtFine_labelIds.png", np.full((64, 128), 26, np.uint8))
            data = datasets.cityscapes(folder, "train")
            self.assertEqual(len(data), 1)
            self.assertEqual(np.unique(data[0][1]).tolist(), [13])

    def test_what_is_missing_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(datasets.DataError, "camvid"):
                datasets.camvid(folder, "train")
            images = Path(folder) / "segmentation/camvid/val/images"
            images.mkdir(parents=True)
            cv2.imwrite(str(images / "a.png"), np.zeros((8, 8, 3), np.uint8))
            with self.assertRaisesRegex(datasets.DataError, "labels/a.png"):
                datasets.camvid(folder, "val")
            (images / "a.png").write_bytes(b"no picture")
            with self.assertRaisesRegex(datasets.DataError, "a.png: missing or not a picture"):
                datasets.camvid(folder, "val")

    def test_held_back_people_are_in_no_training_set(self):
        items = list(range(12))
        train, val = datasets.held_back(items, False), datasets.held_back(items, True)
        self.assertEqual(val, [4, 9])
        self.assertEqual(sorted(train + val), items)

    @unittest.skipUnless((SHARED / "segmentation/coco128").exists(), "no data at hand")
    def test_coco_polygons_become_movable_classes(self):
        data = datasets.coco128(SHARED)
        seen = set()
        for labels in data.labels:
            seen |= set(np.unique(labels))
        self.assertTrue({13, 18, label_set.set_number(label_set.PERSON), label_set.set_number(label_set.STATIC)} <= seen)

    @unittest.skipUnless((SHARED / "segmentation/coco128").exists(), "no data at hand")
    def test_coco_gives_things_that_do_not_move(self):
        things = datasets.static_things(SHARED)
        self.assertGreater(len(things), 100)
        for picture, mask in things:
            self.assertEqual(picture.shape[:2], mask.shape)
            self.assertTrue(mask.any())


if __name__ == "__main__":
    unittest.main()
