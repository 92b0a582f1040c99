; Only the largest disk has a goal; where the others end does not matter.
(define (problem three-disks-one-wanted)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg red_disk left_peg) (on-peg orange_disk left_peg) (on-peg yellow_disk left_peg)
    (on orange_disk red_disk) (on yellow_disk orange_disk) (clear yellow_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk)
    (smaller yellow_disk orange_disk))
  (:goal (on-peg red_disk right_peg)))
