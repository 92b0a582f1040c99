; The classic task with 5 disks: 31 moves.
(define (problem five-disks)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk green_disk blue_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg red_disk left_peg) (on-peg orange_disk left_peg) (on-peg yellow_disk left_peg)
    (on-peg green_disk left_peg) (on-peg blue_disk left_peg)
    (on orange_disk red_disk) (on yellow_disk orange_disk) (on green_disk yellow_disk)
    (on blue_disk green_disk) (clear blue_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk) (smaller green_disk red_disk)
    (smaller blue_disk red_disk)
    (smaller yellow_disk orange_disk) (smaller green_disk orange_disk)
    (smaller blue_disk orange_disk)
    (smaller green_disk yellow_disk) (smaller blue_disk yellow_disk)
    (smaller blue_disk green_disk))
  (:goal (forall (?d - disk) (on-peg ?d right_peg))))
