; The classic task with 3 disks: 7 moves.
(define (problem three-disks)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg red_disk left_peg) (on-peg orange_disk left_peg) (on-peg yellow_disk left_peg)
    (on orange_disk red_disk) (on yellow_disk orange_disk) (clear yellow_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk)
    (smaller yellow_disk orange_disk))
  (:goal (forall (?d - disk) (on-peg ?d right_peg))))
